"""Who drives, and which commands count; with invented time."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telepresence.drive.datagram import decode, encode
from telepresence.drive.pilots import FORGOTTEN, OWNERSHIP, SILENCE, Outgoing, Pilots, Request
from telepresence.drive.session import COOKIE_LIFE, HELLO, MESSAGE, OPEN, PilotHandshake
from telepresence.security.robot_key import RobotKey

KEY = RobotKey(bytes(range(32)))
HERE, THERE = ("10.0.0.2", 5000), ("10.0.0.3", 6000)
SLOW, FAST = (0.1, 0.0, 0.0), (0.2, 0.0, 0.0)


class Pilot:
    """A pilot who receives every report at once unless stated otherwise."""

    def __init__(self, pilots: Pilots, address=HERE, now: float = 100.0, name="", rank=0) -> None:
        self.pilots, self.address, self.number = pilots, address, 0
        handshake = PilotHandshake(KEY, name or f"pilot@{address[0]}", rank)
        (challenge,) = pilots.receive(handshake.hello, address, now)
        assert handshake.take(challenge.datagram)
        self.open, self.wire = handshake.open, handshake.session
        (self.welcome,) = pilots.receive(handshake.open, address, now)
        self.echo = None

    def read(self, outgoing: Outgoing) -> dict:
        return decode(self.wire.unseal(outgoing.datagram))

    @property
    def session(self):
        return next(each for each in self.pilots.everyone if each.opened.session.id == self.wire.id)

    def receive(self, stamp: float) -> None:
        self.pilots.reported(self.session, stamp)
        self.echo = stamp

    def command(self, now: float, velocity=SLOW, *, after: float | None = None, receive=True) -> bytes:
        if receive:
            self.receive(now - 0.01)
        after = now - self.echo if after is None else after
        return self.wire.seal(encode(type="drive", echo=self.echo, after=after, velocity=velocity))

    def go(self, now: float, number=1, *, velocity=None, after: float | None = None) -> None:
        self.receive(now - 0.01)
        goal = {"id": number, "pose": (1.0, 0.0, 0.5)}
        fields = {"echo": self.echo, "after": 0.01 if after is None else after, "velocity": velocity, "goal": goal}
        self.pilots.receive(self.wire.seal(encode(type="drive", **fields)), self.address, now)

    def drive(self, now: float, velocity=SLOW, *, after: float | None = None, receive=True):
        """A command given at `now` that arrives at once, unless `after` says otherwise."""
        return self.pilots.receive(self.command(now, velocity, after=after, receive=receive), self.address, now)

    def ask(self, what: str, number: int | None = None, now: float = 101.0):
        self.number = self.number + 1 if number is None else number
        body = encode(type="ask", id=self.number, what=what)
        return self.pilots.receive(self.wire.seal(body), self.address, now)

    def may(self, what: str) -> bool:
        """Ask; whether it is done, else `text` says why not."""
        (answer,) = self.ask(what)
        if isinstance(answer, Request):
            return True
        self.text = self.read(answer)["text"]
        return False


@pytest.fixture
def pilots():
    return Pilots(KEY)


@pytest.fixture
def pilot(pilots):
    return Pilot(pilots)


def test_a_command_counts_and_carries_its_age(pilots, pilot):
    pilot.receive(100.5)
    pilot.drive(101.0, FAST, after=0.3, receive=False)
    command = pilots.command(101.0)
    assert (command.vx, command.vy, command.wz) == FAST
    assert command.stamp == pytest.approx(100.8), "given 0.3 s after a report that was sent 0.5 s ago"


def test_silence_ends_a_command_as_a_cut_does(pilots, pilot):
    pilot.drive(101.0)
    assert pilots.command(101.0 + SILENCE - 0.01) is not None
    assert pilots.deadline() == pytest.approx(101.0 + SILENCE)
    assert pilots.command(101.0 + SILENCE + 0.001) is None
    assert pilots.cut
    assert "Nothing was heard" in pilots.problem


def test_a_goal_lasts_while_it_is_repeated_and_never_comes_back(pilots, pilot):
    pilot.go(101.0)
    pilot.go(101.15)
    assert pilots.goal(101.3) == (1, (1.0, 0.0, 0.5))
    assert pilots.goal(101.15 + SILENCE + 0.001) is None
    pilot.go(101.5)
    assert pilots.goal(101.5) is None, "its pose was relative to another place"
    assert pilots.goal_state(pilot.session) == (1, "ended")
    pilot.go(101.55, 2)
    assert pilots.goal(101.55).number == 2
    pilots.end_goal("reached")
    assert pilots.goal_state(pilot.session) == (2, "reached")
    assert pilots.deadline() == float("inf")


def test_a_velocity_or_nothing_ends_a_goal(pilots, pilot):
    pilot.go(101.0)
    pilot.go(101.05, velocity=SLOW)
    assert pilots.goal(101.05) is None
    assert pilots.command(101.05).vx == SLOW[0]
    pilot.go(101.1, 2)
    assert pilots.command(101.1) is None
    pilot.drive(101.15, None)
    assert pilots.goal(101.16) is None


def test_a_goal_that_was_held_up_is_refused(pilots, pilot):
    pilot.go(101.0, after=-0.6)
    assert pilots.goal(101.0) is None
    assert "0.6 s late" in pilots.problem


def test_letting_go_is_no_cut(pilots, pilot):
    pilot.drive(101.0)
    pilot.drive(101.05, None)
    assert pilots.command(101.06) is None
    assert not pilots.cut
    assert pilots.problem == ""


def test_a_driver_whose_message_makes_no_sense_is_stopped_as_a_cut_is(pilots, pilot):
    pilot.drive(101.0)
    pilots.receive(pilot.wire.seal(b'{"type": "drive"}'), HERE, 101.02)
    assert pilots.command(101.03) is None and pilots.cut


def test_who_lets_go_because_something_failed_is_stopped_as_a_cut_is(pilots, pilot):
    pilot.drive(101.0)
    body = encode(type="drive", echo=pilot.echo, after=0.0, velocity=None, hard=True)
    pilots.receive(pilot.wire.seal(body), HERE, 101.05)
    assert pilots.command(101.05) is None
    assert pilots.cut


def test_a_command_that_is_not_newer_is_ignored(pilots, pilot):
    first, second = pilot.command(101.0, FAST), pilot.command(101.0, SLOW)
    pilots.receive(second, HERE, 101.0)
    pilots.receive(second, HERE, 101.05)
    pilots.receive(first, HERE, 101.06)
    assert pilots.command(101.07).vx == SLOW[0]
    assert pilots.command(101.0 + SILENCE + 0.001) is None, "nor does it keep the robot driving"


def test_who_was_forgotten_is_not_taken_for_a_stranger(pilots, pilot):
    late = pilot.command(100.1)
    pilots.command(100.1 + FORGOTTEN)
    assert pilots.everyone == () and pilots.receive(late, HERE, 100.2 + FORGOTTEN) == []
    assert pilots.refusal == "of no open session, from 10.0.0.2"
    pilots.receive(pilot.open, HERE, 100.2 + FORGOTTEN + COOKIE_LIFE)
    assert pilots.refusal == "without the robot's key, from 10.0.0.2" and pilots.everyone == ()


def test_commands_that_were_held_up_are_refused(pilots, pilot):
    pilot.receive(100.9)
    pilot.drive(101.6, after=0.1, receive=False)
    assert pilots.command(101.6) is None
    assert "0.6 s late" in pilots.problem
    assert pilots.refused == 1


def test_a_pilot_who_hears_nothing_cannot_drive(pilots, pilot):
    """Given just now, by the pilot's word; but the robot's reports do not reach the pilot."""
    pilot.receive(100.0)
    pilot.drive(101.5, after=1.49, receive=False)
    assert pilots.command(101.5) is None
    assert "has received no report from this robot for 1.5 s" in pilots.problem


def test_an_invented_report_is_no_proof(pilots, pilot):
    pilot.echo = 100.99
    pilot.drive(101.0, receive=False)
    assert pilots.command(101.0) is None


def test_a_clock_that_runs_ahead_is_refused(pilots, pilot):
    pilot.receive(100.99)
    pilot.drive(101.0, after=3.0, receive=False)
    assert pilots.command(101.0) is None
    assert "ahead" in pilots.problem


@pytest.mark.parametrize("velocity", ["[NaN,0,0]", "[1e999,0,0]", "[0,0]"])
def test_what_cannot_be_used_stops_the_robot(pilots, pilot, velocity):
    pilot.drive(101.0)
    bad = encode(type="drive", echo=101.0, after=0.0, velocity=[7]).replace(b"[7]", velocity.encode())
    (answer,) = pilots.receive(pilot.wire.seal(bad), HERE, 101.05)
    assert pilot.read(answer)["type"] == "refused"
    assert pilots.command(101.06) is None
    assert "refused" in pilots.problem


def test_noise_from_elsewhere_does_not_stop_the_robot(pilots, pilot):
    pilot.drive(101.0)
    for address in (THERE, HERE):
        assert pilots.receive(b"\x00\x01noise", address, 101.05) == []
    assert pilots.command(101.06) is not None


def test_one_pilot_drives_and_the_other_waits(pilots, pilot):
    other = Pilot(pilots, THERE)
    pilot.drive(101.0, SLOW)
    other.drive(101.02, FAST)
    assert pilots.command(101.03).vx == SLOW[0]
    assert pilots.driver is pilot.session
    other.drive(101.0 + OWNERSHIP + 0.1, FAST)
    assert pilots.command(101.0 + OWNERSHIP + 0.1).vx == FAST[0]
    assert pilots.driver is other.session


def test_a_pilot_who_leaves_frees_the_robot_at_once(pilots, pilot):
    other = Pilot(pilots, THERE)
    pilot.drive(101.0)
    pilots.release(pilot.session)
    assert pilots.command(101.01) is None
    assert not pilots.cut and pilots.everyone == (other.session,)
    other.drive(101.02, FAST)
    assert pilots.command(101.03).vx == FAST[0]


def test_a_stop_is_reset_by_who_pressed_it_or_a_higher_rank(pilots, pilot):
    other, chief = Pilot(pilots, THERE), Pilot(pilots, ("10.0.0.4", 1), rank=5)
    pilot.drive(101.0)
    assert other.may("stop")
    assert not pilot.may("reset stop"), "not even by who drives"
    assert "pilot@10.0.0.3 at 10.0.0.3 has pressed stop" in pilot.text
    assert other.may("reset stop") and pilot.may("stop")
    assert not other.may("reset stop") and chief.may("reset stop")
    assert pilot.may("stop") and chief.may("stop")
    assert not pilot.may("reset stop") and chief.may("reset stop"), "the stop of the higher rank counts"


def test_a_reset_that_is_repeated_after_a_later_stop_undoes_nothing(pilots, pilot):
    """Its answer was lost, so its pilot asks again, and has pressed stop meanwhile."""
    for what in ("stop", "reset stop", "stop"):
        (request,) = pilot.ask(what)
        pilots.answered(request, True, "done")
    assert pilot.ask("reset stop", number=pilot.number - 1) == []
    assert [type(each) for each in pilot.ask("stop", number=pilot.number - 1)] == [Request], "a late stop counts"


def test_who_pressed_stop_resets_it_after_an_outage(pilots, pilot):
    assert pilot.may("stop")
    pilots.command(110.0)
    assert pilots.everyone == ()
    stranger, again = (Pilot(pilots, (HERE[0], port), 110.0, name) for port, name in ((1, "x"), (2, "")))
    assert not stranger.may("reset stop") and again.may("reset stop")


def test_only_the_driver_or_a_higher_rank_resets_the_bumper_while_somebody_drives(pilots, pilot):
    other, chief = Pilot(pilots, THERE), Pilot(pilots, ("10.0.0.4", 1), rank=1)
    assert other.may("reset bumper")
    pilot.drive(101.0)
    assert not other.may("reset bumper") and "another pilot drives" in other.text
    assert pilot.may("reset bumper") and chief.may("reset bumper")


def test_a_request_is_done_once_however_often_it_is_asked(pilots, pilot):
    (request,) = pilot.ask("stop", 7)
    first = pilot.read(pilots.answered(request, True, "stopped"))
    (again,) = pilot.ask("stop", 7)
    assert pilot.read(again) == first
    assert isinstance(pilot.ask("stop", 8)[0], Request)


def test_a_session_belongs_to_its_address(pilots, pilot):
    pilot.drive(101.0)
    pilot.address = THERE
    assert pilot.drive(101.05, FAST) == []
    assert pilots.command(101.06).vx == SLOW[0]


def test_sessions_end_and_are_limited(pilots, pilot):
    assert len(pilots.everyone) == 1
    pilots.command(103.0)
    assert pilots.everyone == ()
    made = [Pilot(pilots, ("10.0.0.9", port), 104.0) for port in range(12)]
    assert [each.read(each.welcome)["type"] for each in made] == ["welcome"] * 8 + ["refused"] * 4


def test_what_proves_nothing_takes_no_place(pilots):
    for port in range(100):
        handshake = PilotHandshake(KEY, "somebody", 0)
        pilots.receive(handshake.hello, ("10.0.0.9", port), 104.0)
        wrong = PilotHandshake(RobotKey(bytes(32)), "somebody", 0)
        pilots.receive(wrong.hello, ("10.0.0.9", port), 104.0)
    assert pilots.everyone == ()
    assert Pilot(pilots, THERE, 104.0).session


def test_a_handshake_counts_once_from_one_place_and_for_a_while(pilots):
    handshake = PilotHandshake(KEY, "somebody", 0)
    (challenge,) = pilots.receive(handshake.hello, HERE, 100.0)
    handshake.take(challenge.datagram)
    assert pilots.receive(handshake.open, THERE, 100.1) == [], "the cookie is for another address"
    assert pilots.receive(handshake.open, HERE, 100.1 + COOKIE_LIFE) == [], "the cookie is too old"
    first, again = (pilots.receive(handshake.open, HERE, 100.2)[0] for _ in range(2))
    assert handshake.session.unseal(first.datagram) == handshake.session.unseal(again.datagram), "welcome was lost"
    assert len(pilots.everyone) == 1
    Pilot(pilots, HERE, 100.3)
    assert pilots.receive(handshake.open, HERE, 100.4) == [], "a recorded open begins no second session"


def test_a_pilot_who_starts_anew_at_one_place_is_the_same_one(pilots, pilot):
    pilot.drive(101.0, SLOW)
    again = Pilot(pilots, HERE, 101.01)
    assert len(pilots.everyone) == 1 and pilots.driver is again.session
    assert pilot.drive(101.02, FAST, receive=False) == []
    again.drive(101.03, FAST)
    assert pilots.command(101.04).vx == FAST[0]


@settings(max_examples=60)
@given(st.sampled_from([b"", HELLO, OPEN, MESSAGE]), st.one_of(st.binary(max_size=120), st.binary(max_size=1500)))
def test_nothing_comes_of_bytes_without_the_key(kind, tail):
    pilots = Pilots(KEY)
    datagram = kind + tail
    answers = pilots.receive(datagram, HERE, 100.0)
    assert sum(len(answer.datagram) for answer in answers) <= len(datagram)
    assert pilots.everyone == () and pilots.driver is None and pilots.command(100.0) is None
