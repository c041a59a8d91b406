import math

import pytest
from rto_node.command_watchdog import CommandWatchdog, SpeedLimits


@pytest.fixture
def watchdog():
    return CommandWatchdog()


def test_says_nothing_before_the_first_command(watchdog):
    assert watchdog.decide(0.0).velocity is None


def test_passes_a_young_command_and_stops_when_commands_cease(watchdog):
    watchdog.command(0.2, -0.1, 0.3, 1.0)
    assert watchdog.decide(1.4).velocity == (0.2, -0.1, 0.3)
    assert watchdog.decide(1.51).velocity == (0.0, 0.0, 0.0)
    assert "no command for 0.5 s" in watchdog.decide(1.51).reason


def test_is_silent_after_a_moment_of_zeros(watchdog):
    watchdog.command(0.2, 0.0, 0.0, 1.0)
    watchdog.decide(1.45)
    assert watchdog.decide(1.7).velocity == (0.0, 0.0, 0.0)
    assert watchdog.decide(2.0).velocity is None


@pytest.mark.parametrize("bad", [(math.nan, 0, 0), (0, math.inf, 0), (0, 0, -math.inf)])
def test_refuses_what_is_not_a_number(watchdog, bad):
    watchdog.command(0.2, 0.0, 0.0, 1.0)
    watchdog.command(*bad, 1.1)
    command = watchdog.decide(1.2)
    assert command.velocity == (0.0, 0.0, 0.0) and "refused" in command.reason
    assert watchdog.refused == 1


def test_stops_without_a_master(watchdog):
    watchdog.command(0.2, 0.0, 0.0, 1.0)
    assert watchdog.decide(1.1).velocity == (0.2, 0.0, 0.0)
    command = watchdog.decide(1.2, master_alive=False)
    assert command.velocity == (0.0, 0.0, 0.0) and "master" in command.reason


def test_limits_keep_the_direction(watchdog):
    watchdog.command(3.0, 4.0, 9.0, 0.0)
    assert watchdog.decide(0.0).velocity == pytest.approx((0.3, 0.4, 1.0))


def test_small_velocities_pass_unless_the_old_dead_band_is_asked_for():
    watchdog = CommandWatchdog()
    watchdog.command(0.01, 0.0, 0.02, 0.0)
    assert watchdog.decide(0.0).velocity == (0.01, 0.0, 0.02)
    old = CommandWatchdog(SpeedLimits(0.3, 0.6, 0.05, 0.1))
    old.command(-0.01, 0.0, 0.02, 0.0)
    assert old.decide(0.0).velocity == (-0.05, 0.0, 0.1)


@pytest.mark.parametrize("limits", [(0.02, 1.0, 0.05, 0.1), (0.5, 0.05, 0.0, 0.1), (math.inf, 1.0), (0.5, 1.0, -0.1)])
def test_limits_without_room_are_refused(limits):
    """A driver in circulation ships max_linear_vel 0.02 with min_linear_vel 0.05."""
    with pytest.raises(ValueError, match="_vel"):
        SpeedLimits(*limits)
