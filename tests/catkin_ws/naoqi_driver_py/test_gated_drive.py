"""What the driver makes of the two gates' decisions. Times are invented, readings are those of an empty room."""

import math

import numpy as np
import pytest
from naoqi_driver.gated_drive import GatedDrive
from naoqi_driver.range_sensors import Reading

from telepresence.safety import PEPPER, Odometry

PERIOD = 0.05


class Driven:
    """The gate of a robot that follows at once."""

    def __init__(self):
        self.gate = GatedDrive()
        self.now = 100.0
        self.x = 0.0
        self.pressed = ()
        self.ahead = None
        self.measures = True

    def run(self, seconds, vx=None):
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            if self.measures:
                self.gate.receive(self.reading(), self.now)
            if vx is not None:
                self.gate.command(vx, 0.0, 0.0, self.now)
            decision = self.gate.decide(self.now)
            if decision.velocity is not None:
                self.x += decision.velocity.vx * PERIOD
        return decision

    def reading(self):
        points = {}
        for source in PEPPER.sources:
            if source.cone:
                continue
            ranges = np.full(source.beams, source.max_range + 0.5)
            if self.ahead is not None and source.name == "front laser":
                ranges[5:10] = self.ahead - self.x
            points[source.name] = source.origins + ranges[:, None] * source.directions
        ranges = {source.name: source.max_range for source in PEPPER.sources if source.cone}
        return Reading(Odometry(self.x, 0.0, 0.0, self.now), points, ranges, self.pressed)


def test_free_way():
    decision = Driven().run(1.0, 0.3)
    assert (decision.velocity.vx, decision.fault, decision.reason) == (pytest.approx(0.3), False, "driving")


def test_nothing_moves_before_the_sensors_have_spoken():
    driven = Driven()
    driven.measures = False
    decision = driven.run(0.2, 0.3)
    assert decision.velocity is None and decision.fault
    assert decision.reason == "stopped: there is no odometry"


def test_an_obstacle_brakes_gently_and_says_why():
    driven = Driven()
    driven.ahead = 0.6
    decision = driven.run(3.0, 0.3)
    assert decision.velocity.vx == pytest.approx(0.0, abs=0.02) and not decision.fault
    assert "obstacle" in decision.reason


def test_silent_sensors_stop_hard():
    driven = Driven()
    driven.run(1.0, 0.3)
    driven.measures = False
    decision = driven.run(0.7, 0.3)
    assert decision.velocity is None and decision.fault


def test_silence_stops_after_three_tenths_and_is_told_as_ever_after_five():
    driven = Driven()
    driven.run(1.0, 0.3)
    decision = driven.run(0.4)
    assert (decision.velocity, decision.fault) == (None, True)
    assert decision.reason.startswith("stopped: no command for 0.")
    assert driven.run(0.2).reason == "stopped: no command for 0.5 s"


def test_a_command_that_is_no_number_is_counted():
    driven = Driven()
    driven.run(1.0, 0.3)
    decision = driven.run(0.1, math.nan)
    assert decision == (None, True, "stopped: command refused: vx is nan")
    assert driven.gate.refused == 2
    assert driven.gate.decision.state.value == "fault"


def test_a_stop_holds_goals_too_until_it_is_reset():
    driven = Driven()
    driven.run(1.0, 0.3)
    driven.gate.stop("stop requested")
    decision = driven.run(0.1, 0.3)
    assert decision == (None, True, "stopped: stop requested; reset_stop resets it")
    assert not driven.gate.allows_goals
    driven.gate.reset_stop()
    assert driven.gate.allows_goals
    assert driven.run(0.2, 0.3).velocity is None  # the controls are still held
    driven.run(0.1, 0.0)
    assert driven.run(0.5, 0.3).velocity.vx > 0.2


@pytest.mark.parametrize("pressed", [(1.054,), (-1.054,), (1.054, -1.054)])
def test_a_bump_leaves_the_way_back(pressed):
    driven = Driven()
    driven.run(1.0, 0.3)
    driven.pressed = pressed
    driven.run(0.2, 0.0)
    assert not driven.gate.allows_goals
    assert not driven.gate.reset_bumper()
    assert driven.run(0.5, -0.3).velocity.vx == pytest.approx(-0.1)
    driven.pressed = ()
    driven.run(0.1, 0.0)
    assert driven.gate.reset_bumper() and driven.gate.allows_goals


def test_both_front_bumpers_close_the_whole_front():
    driven = Driven()
    driven.run(1.0, 0.3)
    driven.pressed = (1.054, -1.054)
    decision = driven.run(0.5, 0.3)
    assert decision.velocity is None and decision.fault
    assert decision.reason.startswith("stopped: a bumper was hit")


def test_a_bump_is_told_once_and_at_once():
    driven, told = Driven(), []
    driven.gate = GatedDrive(lambda: told.append(driven.gate.latched.bumped))
    driven.run(0.5, 0.3)
    assert not told
    driven.pressed = (0.0,)
    driven.run(PERIOD)
    assert told == [True]
    driven.run(0.5)
    driven.pressed = ()
    driven.run(0.5)
    assert told == [True]
