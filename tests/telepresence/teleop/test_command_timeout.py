"""A velocity command holds for half a second, for every robot."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.teleop.command_timeout import DRIVER_TIMEOUT, CommandState, LatestCommand


@pytest.fixture
def command():
    return LatestCommand()


def test_nothing_moves_before_the_first_command(command):
    assert command.check(100.0) == (ZERO_VELOCITY, CommandState.NONE, "stopped: no command yet")


def test_the_newest_command_counts(command):
    command.put(0.1, 0.0, 0.0, 1.0)
    command.put(0.2, -0.1, 0.5, 1.1)
    assert command.check(1.2) == ((0.2, -0.1, 0.5), CommandState.DRIVING, "driving")


@pytest.mark.parametrize(("age", "drives"), [(0.0, True), (DRIVER_TIMEOUT, True), (0.51, False), (60.0, False)])
def test_it_holds_for_half_a_second(command, age, drives):
    command.put(0.2, 0.0, 0.0, 8.0)
    checked = command.check(8.0 + age)
    assert (checked.velocity == (0.2, 0.0, 0.0)) is drives and checked.counts is drives
    if not drives:
        assert checked[1:] == (CommandState.SILENT, "stopped: no command for 0.5 s")


def test_silence_after_a_zero_is_nothing_to_worry_about(command):
    command.put(0.0, 0.0, 0.0, 0.0)
    assert command.check(0.1)[1:] == (CommandState.ZERO, "stopped: the command is zero")
    assert command.check(9.0) == (ZERO_VELOCITY, CommandState.OVER, "stopped")


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_is_not_finite_is_refused_and_counted(command, bad, axis):
    command.put(0.2, 0.0, 0.0, 0.0)
    parts = [0.1, 0.1, 0.1]
    parts[axis] = bad
    command.put(*parts, 0.1)
    checked = command.check(0.2)
    assert checked.velocity == ZERO_VELOCITY and checked.state is CommandState.REFUSED
    assert f"{Velocity._fields[axis]} is {bad}" in checked.reason and command.refused == 1
    command.put(0.1, 0.0, 0.0, 0.3)
    assert command.check(0.3).state is CommandState.DRIVING


def test_a_lost_master_stops_a_fresh_command(command):
    command.put(0.2, 0.0, 0.0, 0.0)
    assert command.check(0.1, master_alive=False)[:2] == (ZERO_VELOCITY, CommandState.NO_MASTER)


def test_a_forgotten_command_never_was(command):
    command.put(0.2, 0.0, 0.0, 0.0)
    command.clear()
    assert command.check(0.0).state is CommandState.NONE


def test_the_robot_says_what_is_too_fast_and_what_is_too_slow_to_count():
    command = LatestCommand(standstill=1e-3, limit=lambda velocity: velocity._replace(vx=min(velocity.vx, 0.5)))
    command.put(2.0, 0.0, 0.0, 0.0)
    assert command.check(0.0).velocity == (0.5, 0.0, 0.0)
    command.put(0.0, 5e-4, 0.0, 0.1)
    assert command.check(0.1).state is CommandState.ZERO


@given(st.lists(st.tuples(st.floats(), st.floats(), st.floats(), st.floats(0, 2)), max_size=20), st.floats(0, 3))
def test_whatever_arrives_only_fresh_finite_numbers_count(commands, wait):
    command, now = LatestCommand(), 0.0
    for vx, vy, wz, pause in commands:
        now += pause
        command.put(vx, vy, wz, now)
    checked = command.check(now + wait)
    assert all(math.isfinite(part) for part in checked.velocity)
    if checked.state is CommandState.DRIVING:
        assert now + wait - now <= DRIVER_TIMEOUT and checked.velocity == commands[-1][:3]
