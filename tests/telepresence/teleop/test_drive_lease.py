"""One pilot at a time."""

import dataclasses
import hashlib
import math

import pytest

from telepresence.geometry import ZERO_VELOCITY as ZERO
from telepresence.geometry import Velocity
from telepresence.security.signing import PROOF
from telepresence.teleop.drive_lease import COMMAND_AGE, LATE, ZEROS_TIME, DriveLease
from telepresence.teleop.key_agreement import Claim, Credential, WindowSide, public_key
from telepresence.teleop.lease_messages import (
    PILOT,
    WATCHER,
    Account,
    Reply,
    SignedCommand,
    sign_command,
    sign_join,
    sign_reply,
    sign_request,
)
from telepresence.teleop.lease_windows import FORGOTTEN, LEASE, MOST_OF_ONE, MOST_WINDOWS, NOT_ACCEPTED, OFFER
from telepresence.teleop.looking import Look, LookCommand, Manner, read_look, sign_look

AHEAD = Velocity(0.2, 0.0, 0.0)
LEFT = Look(Manner.RATE, 0.5, 0.0)
LEASE_KEY = bytes(range(32))


def account(name, role, rank=0, password=b""):
    private = hashlib.sha256(name.encode() + password).digest()
    return Account(name, role, rank, public_key(private), Credential(private, public_key(LEASE_KEY)))


ACCOUNTS = {
    one.name: one
    for one in (account("anna", PILOT), account("ben", PILOT), account("chief", PILOT, 5), account("will", WATCHER, 9))
}


class Window:
    """What a window does, with a clock of its own."""

    def __init__(self, lease, name, credential=None, now=0.0, node=None):
        self.node = node or f"/window_of_{name}"
        side = WindowSide(name, self.node, credential or ACCOUNTS[name].credential)
        offer = lease.offer(side.claim, now)
        self.lease, self.session, self.claim = lease, offer.session, side.claim
        self.key = side.session_key(offer.session, offer.key)
        self.reason = self.join(now).reason
        self.number = self.asked = self.looked = 0

    def join(self, now, key=None):
        proven = self.lease.prove(self.claim, self.session, sign_join(key or self.key), now)
        return proven if isinstance(proven, Reply) else self.lease.admit(proven, now)

    def command(self, now, velocity=None, hold="", sent=None):
        self.number += 1
        unsigned = SignedCommand(self.number, 1000.0 + now if sent is None else sent, velocity, hold)
        return dataclasses.replace(unsigned, proof=sign_command(self.key, unsigned))

    def send(self, now, velocity=None, hold="", sent=None):
        return self.lease.receive(self.session, self.command(now, velocity, hold, sent), now)

    def look(self, now, look=LEFT, sent=None):
        self.looked += 1
        unsigned = LookCommand(self.looked, 1000.0 + now if sent is None else sent, look)
        self.newest_look = dataclasses.replace(unsigned, proof=sign_look(self.key, unsigned))
        return self.lease.look(self.session, self.newest_look, now)

    def ask(self, action, now=0.0, to=""):
        self.asked += 1
        proof = sign_request(self.key, self.asked, action, to)
        return self.lease.ask(self.session, self.asked, action, to, proof, now)


@pytest.fixture
def lease():
    return DriveLease(ACCOUNTS.get, LEASE_KEY)


@pytest.fixture
def anna(lease):
    window = Window(lease, "anna")
    assert window.ask("take").ok
    lease.tick(ZEROS_TIME)
    return window


def test_only_the_pilot_drives(lease, anna):
    ben = Window(lease, "ben")
    assert anna.send(0.1, AHEAD) == AHEAD
    assert ben.send(0.1, AHEAD) is None and lease.refused == 1
    assert lease.state(0.1).pilot == "anna" and lease.state(0.1).velocity == AHEAD
    assert lease.state(0.1).present == ("anna (pilot)", "ben (pilot)")


def test_a_watcher_cannot_drive_whatever_it_sends(lease):
    will = Window(lease, "will")
    assert not will.ask("take").ok
    assert will.send(0.1, AHEAD) is None
    assert not will.ask("give", to=will.node).ok
    assert lease.state(0.1).pilot == ""


def test_a_watcher_cannot_send_as_the_pilot(lease, anna):
    will = Window(lease, "will")
    forged = will.command(0.1, AHEAD)
    assert lease.receive(anna.session, dataclasses.replace(forged, number=99), 0.1) is None
    with_own_key = Window(lease, "anna", ACCOUNTS["will"].credential)
    assert with_own_key.reason == NOT_ACCEPTED
    assert not with_own_key.ask("take").ok
    assert with_own_key.send(0.1, AHEAD) is None
    assert lease.refused == 2


def test_who_reads_the_accounts_cannot_join_as_somebody(lease):
    stored = ACCOUNTS["anna"].public
    assert Window(lease, "anna", Credential(stored, public_key(LEASE_KEY))).reason == NOT_ACCEPTED
    assert Window(lease, "anna", Credential(LEASE_KEY, public_key(LEASE_KEY))).reason == NOT_ACCEPTED


def test_a_lease_without_the_accounts_own_key_is_no_partner(lease):
    impostor = DriveLease(ACCOUNTS.get, bytes(32))
    assert Window(impostor, "anna").reason == NOT_ACCEPTED, "the two have different keys"


def test_a_proof_counts_once_and_not_for_long(lease):
    anna = Window(lease, "anna")
    assert anna.ask("leave").ok
    assert not anna.join(1.0).ok and lease.state(1.0).present == ()
    late = Window(lease, "anna", now=5.0)
    assert "run out" in late.join(5.1 + OFFER).reason
    assert "run out" in late.join(4.0).reason


def test_a_proof_is_for_one_name_one_node_and_one_session(lease):
    anna, other = Window(lease, "anna"), Window(lease, "anna", node="/other")
    proof = sign_join(anna.key)
    for claim, session in (
        (dataclasses.replace(anna.claim, name="chief"), anna.session),
        (dataclasses.replace(anna.claim, node="/chief"), anna.session),
        (dataclasses.replace(anna.claim, key=other.claim.key), anna.session),
        (anna.claim, other.session),
        (anna.claim, "0-0123456789abcdef"),
    ):
        assert isinstance(lease.prove(claim, session, proof, 0.0), Reply)


@pytest.mark.parametrize("key", [bytes(32), b"\1" + bytes(31), b"\xec" + b"\xff" * 30 + b"\x7f"])
def test_public_keys_of_low_order_are_refused(lease, key):
    claim = Claim("anna", "/w", key)
    session = lease.offer(claim, 0.0).session
    assert lease.prove(claim, session, bytes(PROOF), 0.0) == Reply(False, NOT_ACCEPTED)


def test_unknown_names_are_answered_as_known_ones(lease):
    for name in ("anna", "nobody", "", "x" * 10_000, "\udcff"):
        claim = dataclasses.replace(Window(lease, "ben").claim, name=name)
        offer = lease.offer(claim, 0.0)
        assert len(offer.key) == 32 and not offer.reason
        assert lease.prove(claim, offer.session, bytes(PROOF), 0.0) == Reply(False, NOT_ACCEPTED)


@pytest.mark.parametrize(
    ("today", "why"),
    [
        (None, "was removed"),
        (account("anna", PILOT, password=b"new"), "password"),
        (account("anna", WATCHER), "rank"),
        (account("anna", PILOT, -1), "rank"),
    ],
)
def test_who_is_removed_or_lowered_drives_no_more_and_learns_why(lease, anna, today, why):
    assert anna.send(0.1, AHEAD) == AHEAD
    accounts = {**ACCOUNTS, "anna": today} if today else {}
    lease.revise(lease.sessions(), accounts, 0.2)
    assert lease.tick(0.2) == ZERO and lease.state(0.2).pilot == "" and lease.state(0.2).present == ()
    assert anna.send(0.3, AHEAD) is None
    reply = anna.ask("present", 0.3)
    assert reply.ended and why in reply.reason
    assert lease.sign(anna.session, anna.asked, reply) == sign_reply(anna.key, anna.asked, reply)
    assert not lease.ask(anna.session, 9, "present", "", bytes(PROOF), 0.3).ended, "nobody else is answered"


def test_accounts_that_did_not_change_end_nothing(lease, anna):
    sessions = lease.sessions()
    ben = Window(lease, "ben")
    lease.revise(sessions, {"anna": ACCOUNTS["anna"]}, 0.1)
    assert anna.ask("present").ok and ben.ask("present").ok, "ben joined after the accounts were read"


def test_what_was_sent_before_is_refused(lease, anna):
    command = anna.command(0.1, AHEAD)
    assert lease.receive(anna.session, command, 0.1) == AHEAD
    assert lease.receive(anna.session, command, 0.2) is None
    assert anna.ask("stop").ok and anna.ask("reset_stop").ok
    again = lease.ask(anna.session, 2, "stop", "", sign_request(anna.key, 2, "stop"), 0.3)
    assert not again.ok and lease.state(0.3).stopped_by == ""


@pytest.mark.parametrize("change", [{"number": 50}, {"velocity": Velocity(0.5, 0, 0)}, {"hold": "x"}, {"sent": 5.0}])
def test_a_changed_command_is_refused(lease, anna, change):
    assert lease.receive(anna.session, dataclasses.replace(anna.command(0.1, AHEAD), **change), 0.1) is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_none_are_refused(lease, anna, bad):
    assert anna.send(0.1, Velocity(bad, 0.0, 0.0)) is None
    assert anna.send(0.1, AHEAD, sent=bad) is None
    assert anna.send(0.2, AHEAD) == AHEAD


def test_what_a_network_delivers_late_is_refused(lease, anna):
    assert anna.send(0.1, AHEAD) == AHEAD
    late = [anna.command(0.2 + 0.05 * i, AHEAD) for i in range(40)]
    answers = [lease.receive(anna.session, command, 5.0) for command in late]
    assert answers.count(AHEAD) == 0, "all of them are older than half a second"
    assert anna.send(5.1, AHEAD) == AHEAD
    assert anna.send(5.1 + LATE / 2, AHEAD, sent=1005.1) == AHEAD


def test_clocks_that_part_slowly_do_no_harm(lease, anna):
    now, drift = 0.0, 200e-6
    for _ in range(50_000):
        now += 0.2
        anna.send(now, None, sent=1000.0 + now * (1.0 - drift))
    assert anna.send(now, AHEAD, sent=1000.0 + now * (1.0 - drift)) == AHEAD


def test_silence_stops_and_then_frees(lease, anna):
    anna.send(0.5, AHEAD)
    assert lease.tick(0.5 + COMMAND_AGE - 0.01) is None
    assert lease.tick(0.5 + COMMAND_AGE + 0.01) == ZERO
    assert lease.state(1.4).pilot == "anna"
    lease.tick(0.5 + LEASE + 0.01)
    assert lease.state(1.6).pilot == ""
    ben = Window(lease, "ben", now=1.6)
    assert ben.ask("take", 1.6).ok


def test_a_pilot_whose_connection_closes_drives_no_more_and_may_come_back(lease, anna):
    ben = Window(lease, "ben")
    ben.send(0.0)
    anna.send(0.0, AHEAD)
    assert lease.lost(ben.node, 0.05) is None and lease.tick(0.05) is None, "somebody else's"
    assert lease.lost(anna.node, 0.05) == ZERO
    assert lease.tick(0.1) == ZERO, "repeated"
    assert lease.lost(anna.node, 0.1) is None, "once"
    assert lease.state(0.2).pilot == "anna"
    assert anna.send(0.2, AHEAD) == AHEAD


def test_signs_of_life_keep_the_lease_without_driving(lease, anna):
    for step in range(20):
        anna.send(0.25 * step)
        lease.tick(0.25 * step)
    assert lease.state(5.0).pilot == "anna"


def test_a_second_pilot_asks_and_is_given_the_robot_after_a_zero(lease, anna):
    ben = Window(lease, "ben")
    anna.send(1.0, AHEAD)
    reply = ben.ask("take", 1.0)
    assert not reply.ok and "anna drives" in reply.reason
    assert lease.state(1.0).asking == "ben" and lease.state(1.0).pilot == "anna"
    assert anna.ask("give", 1.0).ok
    assert lease.tick(1.0) == ZERO
    assert anna.send(1.1, AHEAD) is None and ben.send(1.1, AHEAD) == AHEAD
    assert lease.state(1.1).pilot == "ben" and lease.state(1.1).asking == ""


def test_the_pilot_may_keep_the_robot(lease, anna):
    Window(lease, "ben").ask("take", 0.0)
    assert anna.ask("keep").ok and lease.state(0.0).asking == ""


def test_a_robot_can_be_given_to_a_window_that_did_not_ask(lease, anna):
    ben, will = Window(lease, "ben"), Window(lease, "will")
    ben.send(0.0), will.send(0.0)
    assert not anna.ask("give", to=will.node).ok
    assert anna.ask("give", to=ben.node).ok
    assert lease.state(0.0).window == ben.node


def test_a_higher_rank_takes_over(lease, anna):
    anna.send(1.0, AHEAD)
    chief = Window(lease, "chief", now=1.0)
    assert chief.ask("take", 1.0).ok
    assert lease.tick(1.0) == ZERO
    assert anna.send(1.1, AHEAD) is None and lease.state(1.1).pilot == "chief"
    reply = anna.ask("take", 1.1)
    assert not reply.ok and "chief drives" in reply.reason


def test_the_same_person_takes_over_from_an_older_window(lease, anna):
    second = Window(lease, "anna", node="/window_2")
    assert second.ask("take").ok and lease.state(0.0).window == "/window_2"


def test_giving_it_up_and_leaving_free_the_robot(lease, anna):
    assert anna.ask("release").ok and lease.state(0.0).pilot == ""
    assert not anna.ask("release").ok
    assert anna.ask("take").ok
    assert anna.ask("leave").ok and lease.state(0.0).pilot == ""
    assert anna.send(0.1, AHEAD) is None


def test_anybody_stops_and_only_a_pilot_lets_go(lease, anna):
    will, ben, chief = (Window(lease, name) for name in ("will", "ben", "chief"))
    anna.send(1.0, AHEAD)
    assert will.ask("stop", 1.0).ok
    assert lease.tick(1.0) == ZERO
    assert anna.send(1.1, AHEAD) is None
    assert lease.state(1.1).stopped_by == "will" and "red stop" in lease.state(1.1).hold
    assert not will.ask("reset_stop", 1.2).ok
    assert not ben.ask("reset_stop", 1.2).ok
    assert anna.ask("reset_stop", 1.2).ok and anna.send(1.3, AHEAD) == AHEAD
    ben.ask("stop", 1.4)
    assert chief.ask("reset_stop", 1.4).ok


def test_a_stop_is_reset_by_who_pressed_it_or_a_higher_rank(lease, anna):
    ben, chief = Window(lease, "ben"), Window(lease, "chief")
    ben.ask("stop", 1.0)
    refused = anna.ask("reset_stop", 1.0)
    assert not refused.ok and "ben has pressed" in refused.reason
    again = Window(lease, "ben", now=1.1, node="/another_window")
    assert again.ask("reset_stop", 1.1).ok, "after an outage a person comes back in another session"
    anna.ask("stop", 1.2)
    chief.ask("stop", 1.2)
    assert not anna.ask("reset_stop", 1.3).ok, "the stop of the higher rank counts"
    assert chief.ask("reset_stop", 1.3).ok


def test_a_stop_outlives_a_change_of_pilot(lease, anna):
    anna.ask("stop")
    Window(lease, "chief").ask("take")
    assert lease.state(0.0).stopped_by == "anna"


def test_programs_beside_the_windows_drive_unless_held(lease, anna):
    assert lease.receive_other("/teleop_twist_keyboard", AHEAD, 1.0) is None
    assert lease.state(1.0).other == "/teleop_twist_keyboard" and lease.state(2.0).other == ""
    anna.send(2.0, hold="The picture is lost.")
    assert lease.tick(2.0) == ZERO, "a latched keyboard hears it and lets go"
    assert lease.state(2.0).hold == "The picture is lost."
    assert lease.receive_other("/teleop_twist_keyboard", AHEAD, 2.1) == ZERO
    assert lease.receive_other("/teleop_twist_keyboard", ZERO, 2.1) is None
    assert anna.send(2.2, AHEAD, hold="The picture is lost.") is None
    assert anna.send(2.2, ZERO, hold="The picture is lost.") == ZERO
    anna.send(2.3)
    assert lease.receive_other("/teleop_twist_keyboard", AHEAD, 2.3) is None


def test_unknown_names_and_silly_requests_get_a_sentence(lease, anna):
    assert "32 bytes" in lease.offer(Claim("anna", "/w", b""), 0.0).reason
    assert "no name" in Window(lease, "anna", node="no node").reason
    assert not Window(lease, "anna", node="/" + "x" * 300).ask("take").ok
    assert "There is no 'dance'" in anna.ask("dance").reason
    assert "does not know this window" in lease.ask("gone", 1, "take", "", b"", 0.0).reason
    assert lease.receive("gone", anna.command(0.0, AHEAD), 0.0) is None


def test_joins_without_proof_take_no_place(lease, anna):
    for _ in range(3 * MOST_WINDOWS):
        assert lease.offer(anna.claim, 0.0).session
    assert Window(lease, "ben").ask("take").reason.startswith("anna drives")


def test_windows_of_one_account_displace_each_other_but_not_the_pilot(lease, anna):
    windows = [Window(lease, "anna", node=f"/{number}", now=0.1 + 0.01 * number) for number in range(MOST_OF_ONE + 2)]
    assert [window.ask("present").ok for window in windows] == [False] * 2 + [True] * MOST_OF_ONE
    assert anna.ask("present").ok
    again = Window(lease, "anna", node="/5", now=0.5)
    assert again.ask("present").ok and not windows[5].ask("present").ok, "the same window again"


def test_a_full_lease_lets_a_window_in_for_one_that_is_silent(lease):
    many = DriveLease(lambda name: account(name, PILOT), LEASE_KEY)
    for number in range(MOST_WINDOWS):
        ACCOUNTS[f"p{number}"] = account(f"p{number}", PILOT)
        window = Window(many, f"p{number}", now=0.0)
    assert "already" in Window(many, "anna", now=0.5).reason
    window.send(LEASE + 0.1)
    assert not Window(many, "anna", now=LEASE + 0.2).reason
    assert window.ask("present").ok
    Window(many, "ben", now=LEASE + FORGOTTEN + 1.0)
    assert len(many.sessions()) == 1, "the others are forgotten"


def test_texts_of_windows_are_short_and_printable(lease, anna):
    for hold in ("x" * 300, "\x1b[2J", "two\nlines", "\udcff"):
        assert anna.send(0.1, AHEAD, hold=hold) is None
    assert lease.state(0.1).hold == "" and anna.send(0.2, AHEAD) == AHEAD


def test_without_accounts_everybody_is_a_pilot():
    lease = DriveLease(lambda name: Account(name, PILOT))
    ACCOUNTS["guest"] = Account("guest", PILOT)
    guest = Window(lease, "guest")
    assert guest.ask("take").ok and guest.send(0.1, AHEAD) == AHEAD


def test_only_who_has_the_robot_turns_its_head(lease, anna):
    ben, will = Window(lease, "ben"), Window(lease, "will")
    assert anna.look(0.1) == LEFT
    assert ben.look(0.1) is None and will.look(0.1) is None
    assert lease.refused == 2


def test_a_look_is_signed_numbered_and_not_late(lease, anna):
    assert anna.look(0.1) == LEFT
    again = anna.newest_look
    assert lease.look(anna.session, again, 0.15) is None
    assert lease.look(anna.session, dataclasses.replace(again, number=9), 0.2) is None
    assert lease.look(anna.session, dataclasses.replace(again, number=9, look=Look(Manner.AHEAD)), 0.2) is None
    assert anna.look(0.3 + LATE + 0.1, sent=1000.3) is None
    assert anna.look(2.0, Look(Manner.RATE, math.nan, 0.0)) is None
    assert anna.look(2.1) == LEFT


def test_nobody_looks_around_while_the_robot_is_stopped_or_its_picture_is_lost(lease, anna):
    anna.send(0.1, hold="The picture is lost.")
    assert anna.look(0.2) is None
    anna.send(0.3)
    assert anna.look(0.4) == LEFT
    assert anna.ask("stop", 0.5).ok and anna.look(0.6) is None


def test_looking_renews_the_lease(lease, anna):
    anna.look(0.9 * LEASE)
    lease.tick(1.8 * LEASE)
    assert lease.state(1.8 * LEASE).pilot == "anna"


@pytest.mark.parametrize("numbers", [(9, 0.0, 0.0), (1, math.inf, 0.0), (0, 0.0, 0.0)])
def test_what_is_no_look_is_refused(numbers):
    with pytest.raises(ValueError):
        read_look(*numbers)
