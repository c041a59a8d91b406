"""Keys to velocities, with invented time."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from twist_keyboard.keys import DIRECTIONS, STOP_DURATION, LatchedKeys, Velocity, split_keys

TICK = 0.1


def run(keys, start, duration):
    """The commands of a steady 10 Hz loop."""
    return [keys.command(start + TICK * step) for step in range(round(duration / TICK))]


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("i", Velocity(vx=0.2)),
        ("o", Velocity(vx=0.2, wz=-0.5)),
        ("j", Velocity(wz=0.5)),
        ("l", Velocity(wz=-0.5)),
        ("u", Velocity(vx=0.2, wz=0.5)),
        (",", Velocity(vx=-0.2)),
        (".", Velocity(vx=-0.2, wz=0.5)),
        ("m", Velocity(vx=-0.2, wz=-0.5)),
        ("O", Velocity(vx=0.2, vy=-0.2)),
        ("I", Velocity(vx=0.2)),
        ("J", Velocity(vy=0.2)),
        ("L", Velocity(vy=-0.2)),
        ("U", Velocity(vx=0.2, vy=0.2)),
        ("<", Velocity(vx=-0.2)),
        (">", Velocity(vx=-0.2, vy=-0.2)),
        ("M", Velocity(vx=-0.2, vy=0.2)),
        ("t", Velocity(vz=0.2)),
        ("b", Velocity(vz=-0.2)),
        ("up", Velocity(vx=0.2)),
        ("left", Velocity(wz=0.5)),
    ],
)
def test_layout(key, expected):
    """Directions of teleop_twist_keyboard, as its help shows them."""
    keys = LatchedKeys()
    keys.press(key, 0.0)
    assert keys.command(0.0) == expected


def test_a_key_holds_until_the_next():
    keys = LatchedKeys()
    keys.press("i", 0.0)
    assert set(run(keys, 0.0, 60.0)) == {Velocity(vx=0.2)}


@pytest.mark.parametrize("key", ["k", " ", "5", "K", "\x1b", "\n", "\x04", "\x1bOP", "\ufffd"])
def test_any_other_key_stops_and_then_leaves_the_topic_to_others(key):
    keys = LatchedKeys()
    keys.press("i", 0.0)
    keys.command(0.0)
    keys.press(key, 0.05)
    commands = run(keys, 0.05, 2.0)
    zeros = round(STOP_DURATION / TICK)
    assert commands[:zeros] == [Velocity()] * zeros
    assert not any(commands[zeros + 1 :])


def test_nothing_is_published_before_the_first_key():
    assert run(LatchedKeys(), 0.0, 5.0) == [None] * 50


def test_speed_keys_change_the_latched_command_at_once():
    keys = LatchedKeys()
    keys.press("u", 0.0)
    for key, expected in [("q", (0.22, 0.55)), ("w", (0.242, 0.55)), ("e", (0.242, 0.605)), ("z", (0.2178, 0.5445))]:
        keys.press(key, 0.0)
        velocity = keys.command(0.0)
        assert (velocity.vx, velocity.wz) == pytest.approx(expected)


def test_speed_keys_do_not_start_a_robot():
    keys = LatchedKeys()
    for key in "qzwxec":
        keys.press(key, 0.0)
    assert keys.command(0.0) is None


@given(st.lists(st.sampled_from("qzwxecuiojklm,.UIOJLM<>"), max_size=200))
def test_no_key_leads_above_the_limits(pressed):
    keys = LatchedKeys(speed_limit=0.4, turn_limit=1.0)
    for key in pressed:
        keys.press(key, 0.0)
        velocity = keys.command(0.0)
        if velocity:
            assert abs(velocity.vx) <= 0.4 and abs(velocity.vy) <= 0.4 and abs(velocity.wz) <= 1.0


def test_timeout_stops_the_robot_when_asked_for():
    keys = LatchedKeys(key_timeout=1.0)
    keys.press("i", 0.0)
    commands = run(keys, 0.0, 3.0)
    assert commands[:10] == [Velocity(vx=0.2)] * 10
    assert commands[10:15] == [Velocity()] * 5
    assert commands[16:] == [None] * 14


def test_a_program_that_was_stopped_does_not_start_the_robot_again():
    keys = LatchedKeys()
    keys.press("i", 0.0)
    keys.command(0.0)
    assert keys.command(300.0) == Velocity()
    assert not keys.moving


def test_the_key_that_ends_a_pause_counts():
    keys = LatchedKeys()
    keys.command(0.0)
    keys.press("j", 300.0)
    assert keys.command(300.0) == Velocity(wz=0.5)


def test_letting_go_is_silent():
    keys = LatchedKeys()
    keys.press("i", 0.0)
    keys.command(0.0)
    keys.let_go()
    assert keys.command(0.1) is None


@pytest.mark.parametrize(
    ("sent", "keys"),
    [
        ("ik", ["i", "k"]),
        ("\x1b[A\x1b[D", ["up", "left"]),
        ("\x1bOB", ["down"]),
        ("\x1b[15~i", ["\x1b[15~", "i"]),
        ("\x1bi", ["\x1bi"]),
        ("\x1b", ["\x1b"]),
        ("ä", ["ä"]),
    ],
)
def test_escape_sequences_are_one_key(sent, keys):
    assert split_keys(sent) == keys


@given(st.text(max_size=50))
def test_splitting_loses_nothing(text):
    assert len(split_keys(text)) <= len(text)
    assert bool(split_keys(text)) == bool(text)


def test_letters_of_an_escape_sequence_never_drive():
    """The application mode of some terminals sends Esc O C for the right arrow; O alone would drive sideways."""
    assert not [key for key in split_keys("\x1bOP\x1bOQ\x1b[1;5I\x1bu") if key in DIRECTIONS]


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"speed": 0.0}, "speed"),
        ({"speed": math.nan}, "speed"),
        ({"turn": -1.0}, "turn"),
        ({"turn": 5.0}, "turn"),
        ({"speed_limit": math.inf}, "speed"),
        ({"key_timeout": -1.0}, "key_timeout"),
    ],
)
def test_wrong_parameters_are_named(arguments, name):
    with pytest.raises(ValueError, match=name):
        LatchedKeys(**arguments)


def test_speeds_step_by_a_tenth():
    keys = LatchedKeys(speed_limit=10.0, speed=1.0)
    speeds = []
    for _ in range(5):
        keys.press("w", 0.0)
        speeds.append(keys.speed)
    assert [after / before for before, after in pairwise(speeds)] == pytest.approx([1.1] * 4)
