"""Hello, challenge, open: both sides prove the key, and the robot keeps nothing for whoever does not."""

from __future__ import annotations

import pytest

from telepresence.drive.datagram import BadMessage
from telepresence.drive.session import (
    COOKIE_LIFE,
    MAX_BODY,
    MOST_USED,
    TO_PILOT,
    TO_ROBOT,
    KeyMismatch,
    PilotHandshake,
    RobotHandshake,
    Session,
    session_of,
)
from telepresence.security.robot_key import RobotKey

KEY, OTHER = RobotKey(bytes(range(32))), RobotKey(bytes(32))
HERE, THERE = ("10.0.0.2", 5000), ("10.0.0.3", 5000)


def opened(robot, pilot, now=10.0):
    assert pilot.take(robot.challenge(pilot.hello, HERE, now))
    return robot.accept(pilot.open, HERE, now)


@pytest.mark.parametrize("key", [KEY, None])
def test_both_sides_talk_after_the_handshake(key):
    pilot = PilotHandshake(key, "anna@desk", 3)
    got = opened(RobotHandshake(key), pilot)
    assert (got.name, got.rank) == ("anna@desk", 3)
    datagram = pilot.session.seal(b"go")
    assert session_of(datagram) == got.session.id
    assert got.session.unseal(datagram) == b"go" and got.session.unseal(datagram) is None
    assert pilot.session.unseal(got.session.seal(b"went")) == b"went"
    assert pilot.session.unseal(pilot.session.seal(b"go")) is None, "nothing of one's own comes back"


@pytest.mark.parametrize(
    ("robots", "pilots", "said", "robot_has_none"),
    [(KEY, None, "has none", False), (None, KEY, "has no key", True), (KEY, OTHER, "another key", False)],
)
def test_a_pilot_learns_what_is_wrong_with_the_keys(robots, pilots, said, robot_has_none):
    pilot = PilotHandshake(pilots, "anna", 0)
    challenge = RobotHandshake(robots).challenge(pilot.hello, HERE, 10.0)
    with pytest.raises(KeyMismatch, match=said) as caught:
        pilot.take(challenge)
    assert caught.value.robot_has_none is robot_has_none
    assert KEY.text not in str(caught.value) and pilot.session is None


def test_a_challenge_is_shorter_than_its_hello_and_answers_only_that():
    robot, pilot = RobotHandshake(KEY), PilotHandshake(KEY, "anna", 0)
    challenge = robot.challenge(pilot.hello, HERE, 10.0)
    assert len(challenge) < len(pilot.hello)
    assert robot.challenge(pilot.hello[:16], HERE, 10.0) is None
    assert not PilotHandshake(KEY, "anna", 0).take(challenge), "for another hello"
    assert pilot.take(challenge) and not pilot.take(challenge)


def test_an_open_is_for_one_key_address_moment_and_session():
    robot, pilot = RobotHandshake(KEY), PilotHandshake(KEY, "anna", 0)
    pilot.take(robot.challenge(pilot.hello, HERE, 10.0))
    for place, bit in ((30, 1), (50, 1), (-5, 1)):
        changed = bytearray(pilot.open)
        changed[place] ^= bit
        assert robot.accept(bytes(changed), HERE, 10.0) is None
    assert robot.accept(pilot.open, THERE, 10.0) is None
    assert robot.accept(pilot.open, HERE, 10.1 + COOKIE_LIFE) is None
    assert RobotHandshake(KEY).accept(pilot.open, HERE, 10.0) is None, "another start of the robot"
    assert robot.accept(pilot.open, HERE, 10.0) is not None
    assert robot.accept(pilot.open, HERE, 10.0) is None, "twice"


def test_a_session_is_never_opened_twice_though_cookies_are_forgotten():
    robot = RobotHandshake(KEY)
    pilots = [PilotHandshake(KEY, "anna", 0) for _ in range(MOST_USED)]
    assert all(opened(robot, pilot) for pilot in pilots)
    assert opened(robot, PilotHandshake(KEY, "anna", 0)) is None, "there is room for so many in two seconds"
    later = 10.1 + COOKIE_LIFE
    assert opened(robot, PilotHandshake(KEY, "anna", 0), later) is not None
    assert all(robot.accept(pilot.open, HERE, later) is None for pilot in pilots)


@pytest.mark.parametrize(("name", "rank"), [("", 0), ("x" * 65, 0), ("a\x1b[2J", 0), ("anna", -1), ("anna", 10**9)])
def test_names_and_ranks_that_cannot_be_used_are_refused(name, rank):
    with pytest.raises(BadMessage):
        PilotHandshake(KEY, name, rank)


def test_a_body_that_fits_no_datagram_is_refused():
    session = Session(bytes(32), TO_ROBOT, TO_PILOT)
    assert len(session.seal(bytes(MAX_BODY))) == 1400
    with pytest.raises(ValueError, match="fits no datagram"):
        session.seal(bytes(MAX_BODY + 1))
