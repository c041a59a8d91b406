"""Robotino in the world, stepped by hand: what it does against what the engine says is true."""

import math

import numpy as np
import pytest

from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from robotino_sim.models import robotino_model
from robotino_sim.robot import Robotino
from telepresence.sim.scene import build_world

API2 = (
    (0.30, 0.39, 0.41, 0.50, 0.75, 0.80, 0.95, 1.05, 1.30, 1.40, 1.55, 1.80, 2.35, 2.55),
    (0.41, 0.35, 0.30, 0.25, 0.18, 0.16, 0.14, 0.12, 0.10, 0.09, 0.08, 0.07, 0.05, 0.04),
)
SHARP = (
    (0.03, 0.035, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.10, 0.12, 0.14, 0.16, 0.18, 0.20, 0.25, 0.30, 0.35, 0.40),
    (3.03, 2.78, 2.72, 2.33, 2.01, 1.76, 1.55, 1.40, 1.25, 1.04, 0.92, 0.82, 0.73, 0.66, 0.53, 0.42, 0.37, 0.31),
)
RIM, SENSOR_HEIGHT = 0.2264, 0.0566
SIDES = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]


def travelled(robot, start):
    x, y, _, _, _, yaw = robot.truth()
    dx, dy = x - start[0], y - start[1]
    c, s = math.cos(start[5]), math.sin(start[5])
    return dx * c + dy * s, -dx * s + dy * c, math.remainder(yaw - start[5], math.tau)


# --- driving ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "velocity", [(0.2, 0, 0), (-0.2, 0, 0), (0, 0.2, 0), (0, -0.2, 0), (0, 0, 0.8), (0.15, -0.1, 0)]
)
def test_moves_as_commanded(stepped, velocity):
    bench = stepped(noise=False)
    bench.drive(*velocity, 1.0)
    start = bench.robot.truth()
    bench.drive(*velocity, 2.0)
    assert travelled(bench.robot, start) == pytest.approx([2.0 * v for v in velocity], abs=0.004)
    assert bench.velocity() == pytest.approx(velocity, abs=0.003)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_square_of_one_metre_by_odometry_and_truth(stepped, seed):
    """At 0.2 m/s a side takes 5 s of command: the ramps at its ends cancel."""
    bench = stepped(seed=seed)
    start = bench.robot.truth()
    corners = []
    for x, y in SIDES:
        bench.drive(0.2 * x, 0.2 * y, 0.0, 5.0)
        bench.drive(0.0, 0.0, 0.0, 0.6)
        odometry = bench.robot.snapshot().odometry
        corners.append((travelled(bench.robot, start), (odometry.x, odometry.y, odometry.phi)))
    expected = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
    for (true, measured), corner in zip(corners, expected, strict=True):
        assert true[:2] == pytest.approx(corner, abs=0.02)
        assert measured[:2] == pytest.approx(corner, abs=0.02)
        assert measured[:2] == pytest.approx(true[:2], abs=0.02)
        assert measured[2] == pytest.approx(true[2], abs=0.02)


@pytest.mark.parametrize(("velocity", "axis", "rate"), [((0.5, 0, 0), 0, 0.4), ((0, 0, 2.5), 2, math.pi)])
def test_true_acceleration_is_the_ramp(stepped, velocity, axis, rate):
    bench = stepped(noise=False)
    bench.drive(*velocity, 0.2)
    before = bench.velocity()[axis]
    bench.drive(*velocity, 0.5)
    assert (bench.velocity()[axis] - before) / 0.5 == pytest.approx(rate, rel=0.03)


@pytest.mark.parametrize("watchdog", [0.2, 0.5])
def test_silence_stops_the_robot(stepped, watchdog):
    bench = stepped(watchdog=watchdog)
    bench.drive(0.4, 0.0, 0.0, 1.5)
    bench.wait(watchdog - 0.1)
    assert bench.velocity()[0] == pytest.approx(0.4, abs=0.01)
    start = bench.robot.truth()
    bench.wait(0.4)
    assert bench.velocity() == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    stood = travelled(bench.robot, start)[0]
    assert 0.0 < stood < 0.4 * 0.1 + 0.05
    bench.wait(1.0)
    assert travelled(bench.robot, start)[0] == pytest.approx(stood, abs=1e-3)
    assert bench.robot.snapshot().motors == (0.0, 0.0, 0.0)


def test_stands_still_without_commands(stepped):
    bench = stepped("arena")
    start = bench.robot.truth()
    bench.wait(5.0)
    assert bench.robot.truth()[:2] == pytest.approx(start[:2], abs=1e-4)
    odometry = bench.robot.snapshot().odometry
    assert (odometry.x, odometry.y, odometry.phi, odometry.vx, odometry.vy, odometry.omega) == (0.0,) * 6
    assert odometry.seq == 100


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_refuses_numbers_that_are_not_finite(stepped, value):
    bench = stepped()
    with pytest.raises(ValueError, match="finite"):
        bench.robot.set_velocity(0.1, value, 0.0)
    bench.wait(0.2)
    assert bench.robot.snapshot().motors == (0.0, 0.0, 0.0)


def test_reset_puts_everything_back(stepped):
    bench = stepped()
    start = bench.robot.truth()
    bench.robot.inputs_outputs.set_relay(1, True)
    bench.drive(0.3, 0.0, 0.5, 1.0)
    bench.world.reset()
    bench.wait(0.3)
    assert bench.robot.truth() == pytest.approx(start, abs=1e-3)
    odometry = bench.robot.snapshot().odometry
    assert (odometry.x, odometry.y, odometry.phi) == (0.0, 0.0, 0.0)
    assert odometry.seq <= 6
    assert bench.robot.inputs_outputs.relays == [False, False]


# --- bumping and pushing ---------------------------------------------------------------------------------------------


def test_wall_stops_it_presses_the_bumper_and_odometry_drifts(stepped):
    bench = stepped()
    bench.place(3.6, 0.0)
    bench.drive(0.2, 0.0, 0.0, 4.0)
    x, _, _, roll, pitch, _ = bench.robot.truth()
    assert x == pytest.approx(4.0 - 0.2266, abs=0.004)
    assert abs(roll) + abs(pitch) < 0.01
    assert bench.robot.snapshot().bumper
    assert bench.robot.snapshot().odometry.x > 0.5  # the wheels turned on
    bench.drive(-0.2, 0.0, 0.0, 1.0)
    assert not bench.robot.snapshot().bumper


@pytest.mark.parametrize("bearing", [0.0, 2.0, -2.5])
def test_bumper_feels_all_round(stepped, bearing):
    bench = stepped()
    bench.place(3.6, 0.0, yaw=-bearing)
    assert not bench.robot.snapshot().bumper
    bench.drive(0.2 * math.cos(bearing), 0.2 * math.sin(bearing), 0.0, 2.5)
    assert bench.robot.snapshot().bumper


def test_bumper_held_by_a_person(stepped):
    bench = stepped()
    bench.robot.press_bumper(True)
    assert bench.robot.snapshot().bumper
    bench.robot.press_bumper(False)
    assert not bench.robot.snapshot().bumper


def test_pushes_a_box(stepped):
    bench = stepped("arena")
    with bench.world.locked() as data:
        box = data.body("box_small")
        before = box.xpos.copy()
    bench.place(-1.9, -1.80)
    bench.drive(0.2, 0.0, 0.0, 5.0)
    with bench.world.locked() as data:
        moved = data.body("box_small").xpos - before
    assert moved[0] > 0.2
    assert bench.robot.snapshot().bumper


# --- infrared --------------------------------------------------------------------------------------------------------


def expected_reading(distance):
    volts = np.interp(distance, *SHARP)
    step = 5.0 / 4096
    return [float(np.interp(volts + k * step, *API2)) for k in (1.0, 0.0, -1.0)]


@pytest.mark.parametrize("seed", range(3))
def test_readings_are_the_truth_pushed_through_the_tables(stepped, seed):
    """At random places, within one step of the converter, wherever the whole beam falls on one surface."""
    bench = stepped("arena", noise=False)
    rng = np.random.default_rng(seed)
    compared = 0
    for _ in range(150):
        bench.world.reset()
        bench.place(rng.uniform(-3.5, 3.5), rng.uniform(-2.5, 2.5), rng.uniform(-math.pi, math.pi))
        before = [bench.ray(RIM, SENSOR_HEIGHT, math.radians(40.0 * i)) for i in range(9)]
        bench.world.step(4)
        if max(map(abs, bench.velocity())) > 1e-3 or abs(bench.robot.truth()[2]) > 1e-3:
            continue  # placed in something, and pushed out of it
        readings = bench.robot.snapshot().distances
        assert all(0.04 <= reading <= 0.41 for reading in readings)
        for i, reading in enumerate(readings):
            bearing = math.radians(40.0 * i)
            true = bench.ray(RIM, SENSOR_HEIGHT, bearing)
            beam = [bench.ray(RIM, SENSOR_HEIGHT, bearing + turn) for turn in np.radians([-0.8, -0.4, 0.4, 0.8])]
            if not 0.03 < true < 0.40 or np.ptp([true, *beam]) > 0.2 * true:
                continue
            if abs(true - before[i]) > 1e-5:
                continue  # the robot was put into a light box, which flies away
            low, middle, high = expected_reading(true)
            assert low - 5e-4 <= reading <= high + 5e-4, (true, middle, reading)
            compared += 1
    assert compared > 20


def test_noise_is_small_and_repeatable(stepped):
    def series(seed):
        bench = stepped("empty", seed=seed)
        bench.place(4.0 - RIM - 0.2, 0.0)
        found = []
        for _ in range(50):
            bench.world.step(4)
            found.append(bench.robot.snapshot().distances[0])
        return found

    first = series(1)
    assert 0.0002 < np.std(first) < 0.005
    assert first == series(1)
    assert first != series(2)


@pytest.mark.parametrize("i", range(9))
def test_sensors_point_counter_clockwise_from_straight_ahead(stepped, i):
    bench = stepped("empty", noise=False)
    heading = math.radians(40.0 * i)
    bench.place(4.0 - RIM - 0.15, 0.0, yaw=-heading)
    bench.world.step(8)
    readings = bench.robot.snapshot().distances
    assert min(readings) == readings[i] < 0.20


def test_pole_of_two_centimetres_between_two_beams_is_invisible(stepped):
    bench = stepped("arena", noise=False)
    with bench.world.locked() as data:
        x, y, _ = data.geom("pole_02").xpos
    for bearing, seen in ((0.0, True), (20.0, False), (40.0, True), (60.0, False)):
        away = RIM + 0.10
        bench.place(x - away, y, yaw=-math.radians(bearing))
        bench.world.step(8)
        assert (min(bench.robot.snapshot().distances) < 0.41) is seen, bearing


def test_contact_folds_back(stepped):
    bench = stepped("empty", noise=False)
    bench.place(3.7, 0.0)
    bench.drive(0.1, 0.0, 0.0, 2.0)
    assert bench.robot.snapshot().bumper
    assert bench.robot.snapshot().distances[0] > 0.08


# --- laser -----------------------------------------------------------------------------------------------------------


def test_laser_sees_the_room(stepped):
    bench = stepped("empty", laser=True)
    bench.wait(0.3)
    scan = bench.robot.snapshot().scan
    x, y = bench.robot.truth()[:2]
    assert len(scan.ranges) == 441
    assert scan.ranges[220] == pytest.approx(4.0 - x - 0.08, abs=0.05)
    left = round((math.pi / 2 + 1.9198628664) / 0.0087266453)
    assert scan.ranges[left] == pytest.approx(3.0 - y, abs=0.05)


def test_no_laser_no_scan(stepped):
    bench = stepped()
    bench.wait(0.3)
    assert bench.robot.snapshot().scan is None


# --- together with another robot -------------------------------------------------------------------------------------


def test_shares_a_world_with_pepper():
    world = build_world("arena", [pepper_model(), robotino_model()])
    pepper, robotino = Pepper(world, None), Robotino(world, None)
    start, stood = robotino.truth(), pepper.truth()
    for _ in range(40):
        robotino.set_velocity(0.2, 0.0, 0.0)
        world.step(10)
    assert travelled(robotino, start)[0] == pytest.approx(0.35, abs=0.01)
    assert pepper.truth()[:2] == pytest.approx(stood[:2], abs=0.005)
    world.close()


def test_sees_and_feels_pepper():
    world = build_world("empty", [pepper_model(), robotino_model(spawn="spawn_pepper", offset=(-0.75, 0.0))])
    Pepper(world, None)
    robotino = Robotino(world, None)
    nearest = 1.0
    for _ in range(80):
        robotino.set_velocity(0.15, 0.0, 0.0)
        world.step(10)
        nearest = min(nearest, robotino.snapshot().distances[0])
    assert nearest < 0.1
    assert robotino.snapshot().bumper
    world.close()
