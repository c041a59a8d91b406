import math

import numpy as np
import pytest

from robotino_sim.controller import CYCLE, DriveController, Odometry, wrap_phi
from robotino_sim.kinematics import body_velocity, motor_speeds

TICKS = 4
DT = CYCLE / TICKS


class Clocked:
    """A controller driven cycle by cycle, with the floor's view of where it goes."""

    def __init__(self, **options):
        self.controller = DriveController(**options)
        self.now = 0.0
        self.x = self.y = self.theta = 0.0
        self.velocity = (0.0, 0.0, 0.0)

    def command(self, *velocity):
        self.controller.set_velocity(*velocity, self.now)

    def run(self, seconds):
        for _ in range(round(seconds / CYCLE)):
            self.controller.cycle(self.now)
            for _ in range(TICKS):
                self.velocity = vx, vy, wz = self.controller.turn_motors(DT)
                heading = self.theta + 0.5 * wz * DT
                self.x += (vx * math.cos(heading) - vy * math.sin(heading)) * DT
                self.y += (vx * math.sin(heading) + vy * math.cos(heading)) * DT
                self.theta += wz * DT
            self.now += CYCLE

    def drive(self, velocity, seconds):
        for _ in range(round(seconds / 0.1)):
            self.command(*velocity)
            self.run(0.1)


@pytest.fixture
def clocked():
    return Clocked()


@pytest.mark.parametrize(
    ("velocity", "axis", "acceleration"), [((0.5, 0, 0), 0, 0.4), ((0, 0.5, 0), 1, 0.4), ((0, 0, 3.0), 2, math.pi)]
)
def test_ramps_up_and_down(clocked, velocity, axis, acceleration):
    clocked.drive(velocity, 0.5)
    assert clocked.velocity[axis] == pytest.approx(0.5 * acceleration, rel=0.05)
    clocked.drive(velocity, 1.0)
    assert clocked.velocity == pytest.approx(velocity, abs=1e-9)
    clocked.drive((0.0, 0.0, 0.0), 0.5)
    assert clocked.velocity[axis] == pytest.approx(velocity[axis] - 0.5 * acceleration, rel=0.05)


def test_axes_ramp_independently(clocked):
    clocked.drive((0.4, 0.1, 0.0), 0.5)
    assert clocked.velocity == pytest.approx((0.2, 0.1, 0.0), abs=0.01)


def test_motor_clamp_bends_the_path(clocked):
    """(0.8, 0.8, pi) asks for 1309, -1274 and 8365 rpm: only the third motor is cut."""
    wanted = motor_speeds(0.8, 0.8, math.pi)
    assert wanted == pytest.approx((1309.0, -1274.2, 8365.4), abs=0.5)
    clocked.drive((0.8, 0.8, math.pi), 3.0)
    expected = body_velocity((wanted[0], wanted[1], 3000.0))
    assert clocked.controller.motors == pytest.approx((wanted[0], wanted[1], 3000.0), abs=1e-6)
    assert clocked.velocity == pytest.approx(expected, abs=1e-9)
    vx, vy, wz = clocked.velocity
    assert vx < 0.25 and vy < 0.5 and wz < 1.2  # neither direction nor ratio of the command are left


def test_commands_beyond_the_limits_are_cut(clocked):
    clocked.drive((0.0, 0.0, 50.0), 2.0)
    assert clocked.velocity[2] == pytest.approx(math.pi)


@pytest.mark.parametrize("watchdog", [0.2, 0.5])
def test_silence_stops_the_motors_at_once(watchdog):
    clocked = Clocked(watchdog=watchdog)
    clocked.drive((0.4, 0.0, 0.0), 1.5)
    clocked.run(watchdog - 0.12)
    assert clocked.velocity[0] == pytest.approx(0.4)
    clocked.run(0.14)
    # 1764 rpm at 11 500 rpm/s: 0.15 s; the ramp of 0.4 m/s² would take a second.
    clocked.run(0.16)
    assert clocked.controller.motors == (0.0, 0.0, 0.0)
    assert not clocked.controller.moving


def test_ramp_starts_at_zero_after_silence(clocked):
    clocked.drive((0.4, 0.0, 0.0), 1.5)
    clocked.run(1.0)
    clocked.drive((0.4, 0.0, 0.0), 0.5)
    assert clocked.velocity[0] == pytest.approx(0.2, rel=0.05)


def test_a_command_sent_every_200_ms_keeps_it_moving(clocked):
    for _ in range(10):
        clocked.command(0.2, 0.0, 0.0)
        clocked.run(0.2)
    assert clocked.velocity[0] == pytest.approx(0.2)


def test_odometry_follows_a_curve(clocked):
    clocked.drive((0.2, 0.1, 0.5), 6.0)
    clocked.run(0.4)
    found = clocked.controller.odometry
    assert (found.x, found.y) == pytest.approx((clocked.x, clocked.y), abs=0.01)
    assert found.phi == pytest.approx(wrap_phi(clocked.theta), abs=1e-6)


def test_odometry_counts_its_readings(clocked):
    assert [clocked.controller.publish_odometry().seq for _ in range(3)] == [1, 2, 3]
    clocked.controller.set_odometry(1.0, 2.0, math.tau + 0.5)
    assert clocked.controller.odometry == Odometry(1.0, 2.0, pytest.approx(0.5), seq=0)


def test_heading_stays_below_pi(clocked):
    clocked.drive((0.0, 0.0, 1.0), 3.6)
    clocked.run(0.5)
    assert -math.pi <= clocked.controller.odometry.phi < -2.5


@pytest.mark.parametrize("angle", [math.pi, -math.pi, 3 * math.pi])
def test_half_a_turn_is_reported_as_minus_pi(angle):
    assert wrap_phi(angle) == pytest.approx(-math.pi)


def test_wheels_differ_by_seed_and_stay_near_nominal():
    speeds = []
    for seed in range(30):
        clocked = Clocked(rng=np.random.default_rng(seed))
        clocked.drive((0.2, 0.0, 0.0), 1.0)
        speeds.append(clocked.velocity[0])
    assert len(set(speeds)) == 30
    assert max(abs(speed - 0.2) for speed in speeds) < 0.002
