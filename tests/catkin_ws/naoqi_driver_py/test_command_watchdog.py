from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from naoqi_driver.command_watchdog import CommandWatchdog

from telepresence.geometry import Velocity


def test_nothing_moves_before_the_first_command():
    command = CommandWatchdog().decide(now=100.0)
    assert command == (None, False, "stopped: no command yet")


def test_passes_the_newest_command():
    watchdog = CommandWatchdog()
    watchdog.command(0.1, 0.0, 0.0, now=1.0)
    watchdog.command(0.2, -0.1, 0.5, now=1.1)
    assert watchdog.decide(now=1.2) == (Velocity(0.2, -0.1, 0.5), False, "driving")


@pytest.mark.parametrize(("age", "drives"), [(0.0, True), (0.5, True), (0.51, False), (60.0, False)])
def test_a_command_holds_for_half_a_second(age, drives):
    watchdog = CommandWatchdog()
    watchdog.command(0.2, 0.0, 0.0, now=8.0)
    command = watchdog.decide(now=8.0 + age)
    assert (command.velocity is not None) == drives
    if not drives:
        assert command.fault
        assert command.reason == "stopped: no command for 0.5 s"


def test_silence_after_a_commanded_stop_is_no_fault():
    watchdog = CommandWatchdog()
    watchdog.command(0.0, 0.0, 0.0, now=0.0)
    assert watchdog.decide(now=9.0) == (None, False, "stopped")


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_value_that_is_no_number_stops_and_is_counted(bad, axis):
    watchdog = CommandWatchdog()
    watchdog.command(0.2, 0.0, 0.0, now=0.0)
    parts = [0.1, 0.1, 0.1]
    parts[axis] = bad
    watchdog.command(*parts, now=0.1)
    command = watchdog.decide(now=0.2)
    assert command.velocity is None
    assert command.fault
    assert f"{Velocity._fields[axis]} is {bad}" in command.reason
    assert watchdog.refused == 1
    watchdog.command(0.1, 0.0, 0.0, now=0.3)
    assert watchdog.decide(now=0.3).velocity == Velocity(0.1, 0.0, 0.0)


def test_a_lost_master_wins_over_a_fresh_command():
    watchdog = CommandWatchdog()
    watchdog.command(0.2, 0.0, 0.0, now=0.0)
    command = watchdog.decide(now=0.1, master_alive=False)
    assert command.velocity is None
    assert command.fault
    assert "master" in command.reason


@given(st.lists(st.tuples(st.floats(), st.floats(), st.floats(), st.floats(0, 2)), max_size=20), st.floats(0, 3))
def test_whatever_arrives_only_fresh_finite_numbers_leave(commands, wait):
    watchdog, now = CommandWatchdog(), 0.0
    for vx, vy, wz, pause in commands:
        now += pause
        watchdog.command(vx, vy, wz, now)
    velocity = watchdog.decide(now + wait).velocity
    if velocity is not None:
        assert all(math.isfinite(part) for part in velocity)
        assert wait <= watchdog.timeout
        assert velocity == commands[-1][:3]
