"""A bump of which nobody knows where it was: the pilot tries, and the gate ends what does not help. Times are
invented."""

import math

import pytest

from telepresence.safety import ROBOTINO, Command, Latched, Odometry, State, VelocityGate
from telepresence.safety.latches import TRIED, BumperLatch

PERIOD = 0.05
SPEED = ROBOTINO.limits.escape_speed
STEP = SPEED * PERIOD
"""The robot does not stop before the tick after the one in which it has gone too far [m]."""


class Robot:
    """Stands, follows at once, and feels its bumper as long as `pressed` says of its place."""

    def __init__(self, gate, pressed=lambda x, y: True):
        self.gate, self.pressed = gate, pressed
        self.now = self.x = self.y = 0.0
        self.run(1.0, (0.0, 0.0))

    def run(self, seconds, way):
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            self.gate.update_ranges("infrared", self.now, [0.41] * 9)
            self.gate.update_bumper(self.now, self.pressed(self.x, self.y))
            command = Command(0.2 * way[0], 0.2 * way[1], 0.0, self.now)
            decision = self.gate.step(self.now, command, Odometry(self.x, self.y, 0.0, self.now))
            self.x, self.y = self.x + decision.vx * PERIOD, self.y + decision.vy * PERIOD
        return decision


def restored():
    gate = VelocityGate(ROBOTINO)
    gate.restore(Latched(bumped=True))
    return gate


@pytest.fixture(params=[lambda: VelocityGate(ROBOTINO), restored], ids=["bumped while standing", "restored"])
def gate(request):
    return request.param()


def test_a_way_that_does_not_release_the_bumper_ends(gate):
    robot = Robot(gate)
    decision = robot.run(3.0, (1.0, 0.0))
    assert TRIED - STEP < robot.x < TRIED + 2 * STEP
    assert decision.speed < 1e-6 and decision.state is State.BUMPED
    assert "where is not known" in decision.reason and "3 cm" in decision.reason
    robot.run(1.0, (math.cos(0.9), math.sin(0.9)))
    assert robot.x < TRIED + 2 * STEP, "nor at an angle"


def test_the_way_that_releases_it_goes_on(gate):
    robot = Robot(gate, lambda x, y: x > -0.02)
    robot.run(3.0, (1.0, 0.0))
    decision = robot.run(2.0, (-1.0, 0.0))
    assert decision.vx == pytest.approx(-SPEED) and robot.x < -0.10
    assert decision.reason == "A bumper was hit, where is not known: slowly, until it is reset."
    assert gate.reset_bumper()
    assert robot.run(0.5, (1.0, 0.0)).vx == pytest.approx(0.2)


def test_whatever_holds_the_bumper_the_robot_may_move_but_not_far(gate):
    robot = Robot(gate)
    for degrees in (0, 180, 90, -90, 45, 200, 0, 10, 20):
        x, y = robot.x, robot.y
        robot.run(1.0, (math.cos(math.radians(degrees)), math.sin(math.radians(degrees))))
        assert math.hypot(robot.x, robot.y) < TRIED + 2 * STEP
        assert degrees in (10, 20) or math.hypot(robot.x - x, robot.y - y) > 0.02, "there is always some way out"


def test_a_known_contact_is_not_guessed_anew():
    latch = BumperLatch()
    latch.press(0.0)
    latch.move(0.0, 0.0)
    latch.move(-1.0, 0.0)
    assert latch.normal(0.0) == (1.0, 0.0)
