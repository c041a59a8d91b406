import math

import pytest
from rto_node.command_gate import CommandGate, SpeedLimits


@pytest.fixture
def gate():
    return CommandGate()


def test_says_nothing_before_the_first_command(gate):
    assert gate.decide(0.0).velocity is None


def test_passes_a_young_command_and_stops_when_commands_cease(gate):
    gate.command(0.2, -0.1, 0.3, 1.0)
    assert gate.decide(1.4).velocity == (0.2, -0.1, 0.3)
    assert gate.decide(1.51).velocity == (0.0, 0.0, 0.0)
    assert "no command for 0.5 s" in gate.decide(1.51).reason


def test_is_silent_after_a_moment_of_zeros(gate):
    gate.command(0.2, 0.0, 0.0, 1.0)
    gate.decide(1.45)
    assert gate.decide(1.7).velocity == (0.0, 0.0, 0.0)
    assert gate.decide(2.0).velocity is None


@pytest.mark.parametrize("bad", [(math.nan, 0, 0), (0, math.inf, 0), (0, 0, -math.inf)])
def test_refuses_what_is_not_a_number(gate, bad):
    gate.command(0.2, 0.0, 0.0, 1.0)
    gate.command(*bad, 1.1)
    decision = gate.decide(1.2)
    assert decision.velocity == (0.0, 0.0, 0.0) and "refused" in decision.reason
    assert gate.refused == 1


def test_stops_without_a_master(gate):
    gate.command(0.2, 0.0, 0.0, 1.0)
    assert gate.decide(1.1).velocity == (0.2, 0.0, 0.0)
    decision = gate.decide(1.2, master_alive=False)
    assert decision.velocity == (0.0, 0.0, 0.0) and "master" in decision.reason


def test_limits_keep_the_direction(gate):
    gate.command(3.0, 4.0, 9.0, 0.0)
    assert gate.decide(0.0).velocity == pytest.approx((0.3, 0.4, 1.0))


def test_small_velocities_pass_unless_the_old_dead_band_is_asked_for():
    gate = CommandGate()
    gate.command(0.01, 0.0, 0.02, 0.0)
    assert gate.decide(0.0).velocity == (0.01, 0.0, 0.02)
    old = CommandGate(SpeedLimits(0.3, 0.6, 0.05, 0.1))
    old.command(-0.01, 0.0, 0.02, 0.0)
    assert old.decide(0.0).velocity == (-0.05, 0.0, 0.1)


@pytest.mark.parametrize("limits", [(0.02, 1.0, 0.05, 0.1), (0.5, 0.05, 0.0, 0.1), (math.inf, 1.0), (0.5, 1.0, -0.1)])
def test_limits_without_room_are_refused(limits):
    """A driver in circulation ships max_linear_vel 0.02 with min_linear_vel 0.05."""
    with pytest.raises(ValueError, match="_vel"):
        SpeedLimits(*limits)
