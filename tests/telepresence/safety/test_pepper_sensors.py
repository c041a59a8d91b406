"""Pepper's profile in the gate: which sensor keeps which way open, and the way out after a bump. Times are invented."""

import math

import pytest

from telepresence.safety import PEPPER, Command, Odometry, State, VelocityGate

PERIOD = 0.05


class Pepper:
    """The gate and a robot that follows at once, in empty space."""

    def __init__(self):
        self.gate = VelocityGate(PEPPER)
        self.now = 0.0
        self.x = 0.0
        self.silent = ()

    def run(self, seconds, vx):
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            for source in PEPPER.sources:
                if source.name not in self.silent:
                    self.gate.update_ranges(source.name, self.now, [source.max_range] * source.beams)
            odometry = Odometry(self.x, 0.0, 0.0, self.now)
            decision = self.gate.step(self.now, Command(vx, 0.0, 0.0, self.now), odometry)
            self.x += decision.vx * PERIOD
        return decision


def test_a_sonar_does_not_stand_in_for_a_silent_laser():
    pepper = Pepper()
    assert pepper.run(2.0, 0.3).vx == pytest.approx(0.3)
    pepper.silent = ("front laser",)
    decision = pepper.run(1.0, 0.3)
    assert decision.vx == 0.0
    assert decision.reason.startswith("The front laser is silent for")
    assert pepper.run(0.5, -0.1).vx == pytest.approx(-0.1)
    pepper.silent = ()
    assert pepper.run(2.0, 0.3).vx == pytest.approx(0.3)


def test_the_way_back_needs_the_back_sonar():
    pepper = Pepper()
    assert pepper.run(1.0, -0.1).vx == pytest.approx(-0.1)
    pepper.silent = ("back sonar",)
    decision = pepper.run(1.0, -0.1)
    assert decision.vx == 0.0
    assert decision.reason.startswith("The back sonar is silent for")
    assert pepper.run(1.0, 0.3).vx > 0.2


@pytest.mark.parametrize("driving", [0.25, 0.0])
@pytest.mark.parametrize("bumpers", [(1.054,), (-1.054,), (1.054, -1.054), (math.pi,)])
def test_after_a_bump_the_way_out_is_free(driving, bumpers):
    pepper = Pepper()
    forward = -1.0 if bumpers == (math.pi,) else 1.0
    pepper.run(1.0, forward * driving)
    for bearing in bumpers:
        pepper.gate.update_bumper(pepper.now, True, bearing)
    into = pepper.run(0.5, forward * 0.25)
    assert into.state is State.BUMPED
    assert all(into.vx * math.cos(b) + into.vy * math.sin(b) < 1e-6 for b in bumpers)
    out = pepper.run(0.5, forward * -0.25)
    assert (out.state, out.vx) == (State.BUMPED, pytest.approx(forward * -0.1))
