"""Who drives, and which commands count; with invented time."""

from __future__ import annotations

import pytest
from rto_bringup.onboard.pilots import OWNERSHIP, SILENCE, Outgoing, Pilots, Request
from rto_node.drive_datagram import decode, encode

HERE, THERE = ("10.0.0.2", 5000), ("10.0.0.3", 6000)
SLOW, FAST = (0.1, 0.0, 0.0), (0.2, 0.0, 0.0)


class Pilot:
    """A pilot who receives every report at once unless stated otherwise."""

    def __init__(self, pilots: Pilots, address=HERE, now: float = 100.0) -> None:
        self.pilots, self.address, self.seq = pilots, address, 0
        (welcome,) = pilots.receive(encode(type="hello"), address, now)
        self.token = decode(welcome.datagram)["session"]
        self.echo = None

    @property
    def session(self):
        return next(each for each in self.pilots.sessions if each.token == self.token)

    def receive(self, stamp: float) -> None:
        self.pilots.reported(self.session, stamp)
        self.echo = stamp

    def drive(self, now: float, velocity=SLOW, *, after: float | None = None, seq: int | None = None, receive=True):
        """A command given at `now` that arrives at once, unless `after` says otherwise."""
        if receive:
            self.receive(now - 0.01)
        self.seq = self.seq + 1 if seq is None else seq
        after = now - self.echo if after is None else after
        return self.pilots.receive(
            encode(type="drive", session=self.token, seq=self.seq, echo=self.echo, after=after, velocity=velocity),
            self.address,
            now,
        )

    def ask(self, what: str, number: int = 1, now: float = 101.0):
        return self.pilots.receive(encode(type="ask", session=self.token, id=number, what=what), self.address, now)


@pytest.fixture
def pilots():
    return Pilots()


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


def test_letting_go_is_no_cut(pilots, pilot):
    pilot.drive(101.0)
    pilot.drive(101.05, None)
    assert pilots.command(101.06) is None
    assert not pilots.cut
    assert pilots.problem == ""


def test_a_command_that_is_not_newer_is_ignored(pilots, pilot):
    pilot.drive(101.0, SLOW, seq=5)
    pilot.drive(101.05, FAST, seq=5)
    pilot.drive(101.06, FAST, seq=4)
    assert pilots.command(101.07).vx == SLOW[0]
    assert pilots.command(101.0 + SILENCE + 0.001) is None, "nor does it keep the robot driving"


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
    assert "has not heard this robot for 1.5 s" in pilots.problem


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
    bad = encode(type="drive", session=pilot.token, seq=9, echo=101.0, after=0.0, velocity=[7]).replace(
        b"[7]", velocity.encode()
    )
    (answer,) = pilots.receive(bad, HERE, 101.05)
    assert decode(answer.datagram)["type"] == "refused"
    assert pilots.command(101.06) is None
    assert "refused" in pilots.problem


def test_noise_from_elsewhere_does_not_stop_the_robot(pilots, pilot):
    pilot.drive(101.0)
    pilots.receive(b"\x00\x01noise", THERE, 101.05)
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
    assert not pilots.cut
    other.drive(101.02, FAST)
    assert pilots.command(101.03).vx == FAST[0]


def test_anybody_may_stop_but_only_the_driver_resets(pilots, pilot):
    other = Pilot(pilots, THERE)
    pilot.drive(101.0)
    (request,) = other.ask("stop")
    assert isinstance(request, Request)
    (answer,) = other.ask("reset stop", 2)
    assert decode(answer.datagram)["ok"] is False
    assert "10.0.0.2" in decode(answer.datagram)["text"]


def test_a_request_is_done_once_however_often_it_is_asked(pilots, pilot):
    (request,) = pilot.ask("stop", 7)
    first = pilots.answered(request, True, "stopped")
    (again,) = pilot.ask("stop", 7)
    assert again == first
    assert isinstance(pilot.ask("stop", 8)[0], Request)


def test_a_session_belongs_to_its_address(pilots, pilot):
    pilot.drive(101.0)
    pilot.address = THERE
    (answer,) = pilot.drive(101.05, FAST)
    assert decode(answer.datagram) == {"type": "unknown session"}
    assert pilots.command(101.06).vx == SLOW[0]


def test_sessions_end_and_are_limited(pilots, pilot):
    assert len(pilots.sessions) == 1
    pilots.command(103.0)
    assert pilots.sessions == ()
    answers = [pilots.receive(encode(type="hello"), ("10.0.0.9", port), 104.0)[0] for port in range(12)]
    kinds = [decode(answer.datagram)["type"] for answer in answers]
    assert kinds == ["welcome"] * 8 + ["refused"] * 4
    assert all(isinstance(answer, Outgoing) for answer in answers)


def test_a_second_greeting_from_one_place_is_the_same_pilot(pilots, pilot):
    pilot.drive(101.0, SLOW, seq=50)
    again = Pilot(pilots, HERE, 101.01)
    assert again.token == pilot.token, "an answer that is on its way stays true"
    again.drive(101.02, FAST, seq=1)
    assert pilots.command(101.03).vx == FAST[0], "a program that was started anew counts from the beginning"
