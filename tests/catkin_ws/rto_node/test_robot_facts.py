import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from rto_node import robot_facts

from robotino_sim.kinematics import GEAR, motor_speeds
from telepresence.safety import ROBOTINO

ROOT = Path(__file__).resolve().parents[3]

READINGS = [0.41, 0.1, 0.2, 0.41, 0.3, 0.41, 0.05, 0.41, 0.25]


def test_guide_points():
    points = robot_facts.guide_points(READINGS)
    assert points[0] == pytest.approx((0.61, 0.0, 0.05))
    assert points[1] == pytest.approx((0.3 * math.cos(0.698), 0.3 * math.sin(0.698), 0.05))
    assert robot_facts.ranges_of_guide_points([p[:2] for p in points]) == pytest.approx(READINGS)


def test_ring_scan_turns_counter_clockwise_from_minus_160_degrees():
    ranges = robot_facts.ring_scan(READINGS)
    angles = [robot_facts.SCAN_START + i * robot_facts.RING_STEP for i in range(9)]
    assert angles[0] == pytest.approx(math.radians(-160)) and angles[-1] == pytest.approx(math.radians(160))
    for i, reading in enumerate(READINGS):
        bearing = math.remainder(math.radians(40.0 * i), math.tau)
        index = min(range(9), key=lambda k: abs(math.remainder(angles[k] - bearing, math.tau)))
        assert ranges[index] == (math.inf if reading == 0.41 else pytest.approx(reading + 0.2264))


@pytest.mark.parametrize("reading", [-1.0, math.nan])
def test_no_reading_is_no_place(reading):
    readings = [reading, *READINGS[1:]]
    assert math.isnan(robot_facts.ring_scan(readings)[4]), "the range ahead"
    x, y, _ = robot_facts.guide_points(readings)[0]
    assert math.isnan(x) and math.isnan(y)
    assert robot_facts.guide_points(readings)[1:] == robot_facts.guide_points(READINGS)[1:]


def test_what_is_too_near_to_be_measured_is_no_range_but_still_a_point():
    assert robot_facts.ring_scan([0.0, *READINGS[1:]])[4] == -math.inf
    assert robot_facts.ring_scan([robot_facts.NEAREST, *READINGS[1:]])[4] == pytest.approx(0.2664)
    assert robot_facts.guide_points([0.0, *READINGS[1:]])[0] == pytest.approx((0.2, 0.0, 0.05))


@pytest.mark.parametrize("velocity", [(0.2, 0, 0), (0, 0.3, 0), (0, 0, 1), (0.1, -0.2, 0.5)])
def test_wheels_turn_as_the_robots_own_equations_say(velocity):
    """32 motor turns are one of the wheel."""
    expected = [rpm / GEAR * math.tau / 60.0 for rpm in motor_speeds(*velocity)]
    assert robot_facts.wheel_speeds(*velocity) == pytest.approx(expected)


def test_the_gates_profile_has_the_same_ring():
    (ring,) = ROBOTINO.sources
    assert ring.origins[0] == pytest.approx((robot_facts.RING_RADIUS, 0.0)) and ring.beams == robot_facts.SENSORS
    assert ring.bearings[1] == pytest.approx(robot_facts.RING_STEP)
    assert ring.min_range == robot_facts.NEAREST and ring.max_range <= robot_facts.NOTHING


def test_the_urdf_has_the_same_ring_wheels_and_laser():
    urdf = ElementTree.parse(ROOT / "catkin_ws/src/rto_description/urdf/robotino.urdf").getroot()
    places = {
        joint.get("name"): [float(part) for part in joint.find("origin").get("xyz").split()]
        for joint in urdf.findall("joint/origin[@xyz]/..")
    }
    assert set(robot_facts.WHEEL_JOINTS) <= set(places)
    assert places["laser_joint"][0] == robot_facts.LASER_MOUNT
    ahead = [place for place in places.values() if place == [robot_facts.RING_RADIUS, 0.0, 0.0566]]
    assert len(ahead) == 1, "the sensor that looks ahead"
    for joint in robot_facts.WHEEL_JOINTS:
        assert math.hypot(*places[joint][:2]) == pytest.approx(robot_facts.CENTRE_TO_WHEEL, abs=1e-3)


@pytest.mark.parametrize("velocity", [(0.3, 0.0, 0.0), (0.1, -0.2, 0.5)])
def test_motors_turn_as_the_robots_own_equations_say(velocity):
    assert robot_facts.motor_speeds(robot_facts.wheel_speeds(*velocity)) == pytest.approx(motor_speeds(*velocity))


def test_a_costmap_forgets_only_straight_ahead():
    """All around it would forget, behind the robot, what the laser saw before the robot turned."""
    x, y, z = robot_facts.CLEARING_POINT
    assert (math.hypot(x, y), math.degrees(math.atan2(y, x)), z) == pytest.approx((5.0, 0.5, 0.05), abs=1e-3)
