"""Messages to readings, by field names alone."""

import math
from types import SimpleNamespace as Message

import numpy as np
import pytest

from gui.ros.readings import Careful
from gui.ros.topics.sensors import (
    BumperHistory,
    Mount,
    infrared_ring,
    read_battery,
    read_careful,
    read_lens,
    read_odometry,
    read_page_state,
    read_safety,
    scan_points,
    sonar_cone,
)
from gui.ros.topics.simulation import read_body_state


def scan(ranges, start=0.0, step=math.pi / 2):
    return Message(ranges=ranges, angle_min=start, angle_increment=step, range_min=0.1, range_max=3.0)


def test_a_scan_becomes_places_in_the_base_frame():
    points = scan_points("laser", Mount(0.08, 0.0, 0.0))(scan([1.0, 2.0]), 5.0)
    assert points.at == pytest.approx(np.array([(1.08, 0.0), (0.08, 2.0)])) and points.arrived == 5.0


def test_a_scanner_that_is_turned_looks_where_it_is_turned():
    points = scan_points("laser", Mount(0.0, 0.1, math.pi / 2))(scan([1.0]), 0.0)
    assert points.at == pytest.approx(np.array([(0.0, 1.1)]), abs=1e-9)


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf, -1.0, 0.05, 3.5])
def test_what_is_no_measurement_is_no_place(nothing):
    assert len(scan_points("laser")(scan([nothing]), 0.0).at) == 0


def test_infrared_readings_begin_at_the_ring():
    at = [Message(x=0.4, y=0.0, z=0.05), Message(x=0.0, y=0.61, z=0.05)]
    for channels in ([], [Message(name="range", values=[0.2, 0.41])]):
        beams = infrared_ring(Message(points=at, channels=channels), 0.0)
        assert beams.ranges == pytest.approx([0.2, math.inf]) and beams.starts[0] == pytest.approx((0.2264, 0.0))
        assert beams.bearings == pytest.approx([0.0, math.pi])


@pytest.mark.parametrize(("told", "shown"), [(1.2, 1.2), (math.inf, math.inf), (-math.inf, 0.25)])
def test_a_sonar_that_is_too_near_to_tell_shows_its_nearest(told, shown):
    message = Message(range=told, min_range=0.25, max_range=2.55, field_of_view=1.05)
    cone = sonar_cone("front", Mount(0.07))(message, 0.0)
    assert cone.range == shown and cone.x == 0.07


def test_bumpers_are_remembered_one_by_one():
    memory = BumperHistory()
    memory.convert(Message(bumper=1, state=1), 0.0)
    assert memory.convert(Message(bumper=0, state=1), 0.0).pressed == {"left", "right"}
    assert memory.convert(Message(bumper=1, state=0), 0.0).pressed == {"right"}
    with pytest.raises(ValueError, match="no bumper 7"):
        memory.convert(Message(bumper=7, state=1), 0.0)


def odometry(x=0.0, roll=0.0, pitch=0.0, yaw=0.0):
    c, s = zip(*((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw)), strict=True)
    q = Message(
        x=s[0] * c[1] * c[2] - c[0] * s[1] * s[2], y=c[0] * s[1] * c[2] + s[0] * c[1] * s[2],
        z=c[0] * c[1] * s[2] - s[0] * s[1] * c[2], w=c[0] * c[1] * c[2] + s[0] * s[1] * s[2],
    )  # fmt: skip
    zero = Message(x=0.0, y=0.0, z=0.0)
    return Message(
        header=Message(frame_id="/odom"),
        pose=Message(pose=Message(position=Message(x=x, y=0.0, z=0.8), orientation=q)),
        twist=Message(twist=Message(linear=zero, angular=zero)),
    )


def test_odometry_tells_attitude():
    body = read_odometry(odometry(1.0, 0.1, -0.2, 2.5), 3.0)
    assert (body.x, body.roll, body.pitch, body.yaw) == pytest.approx((1.0, 0.1, -0.2, 2.5))
    assert body.frame == "odom" and body.arrived == 3.0


def test_odometry_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="not finite"):
        read_odometry(odometry(math.nan), 0.0)


def test_the_safety_message_is_taken_over():
    message = Message(
        state="blocked", reason="a wall", allowed=[0.1] * 72, gap=0.3, sector=-1, command_age=0.1, vx=0.1, vy=0.0,
        wz=0.2, scanning=False,
    )  # fmt: skip
    safety = read_safety(message, 1.0)
    assert safety.sector is None and safety.given == (0.1, 0.0, 0.2)
    assert safety.allowed_towards(-0.04) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("text", "reading"),
    [
        ("on by default", Careful(True, True)),
        ("off", Careful(False, False)),
        ("unavailable: The laser sees: all around.", Careful(False, False, "The laser sees: all around.")),
    ],
)
def test_the_careful_scan_is_on_off_or_unavailable(text, reading):
    assert read_careful(Message(data=text), 0.0) == reading


def test_another_text_is_no_state_of_the_careful_scan():
    with pytest.raises(ValueError, match="careful"):
        read_careful(Message(data="on and off"), 0.0)


def test_directions_of_allowed_speeds_go_counter_clockwise():
    allowed = np.zeros(72)
    allowed[18] = 0.3
    message = Message(
        state="", reason="", allowed=allowed, gap=0, sector=3, command_age=0, vx=0, vy=0, wz=0, scanning=False
    )
    safety = read_safety(message, 0.0)
    assert safety.allowed_towards(math.pi / 2) == pytest.approx(0.3) and safety.allowed_towards(-math.pi / 2) == 0.0


def test_a_battery_without_voltage_tells_none():
    message = Message(percentage=0.5, voltage=0.0, power_supply_status=1, power_supply_technology=2)
    battery = read_battery(message, 0.0)
    assert math.isnan(battery.voltage) and battery.charging and not battery.low


def test_the_tablets_page_is_told_with_its_address():
    message = Message(message="live", values=[Message(key="page", value="http://10.0.0.2:10002/")])
    state = read_page_state(message, 0.0)
    assert (state.text, state.page) == ("live", "http://10.0.0.2:10002/")


def test_an_uncalibrated_camera_is_refused():
    message = Message(K=[0.0] * 9, width=640, height=480, header=Message(frame_id="camera"))
    with pytest.raises(ValueError, match="no calibration"):
        read_lens(message, 0.0)


def test_body_state_is_six_finite_numbers():
    pose = read_body_state(Message(data=[1.0, 2.0, 0.2, 0.1, 0.0, -1.5]), 7.0)
    assert (pose.x, pose.z, pose.yaw, pose.arrived) == (1.0, 0.2, -1.5, 7.0)
    for data in ([1.0] * 5, [1.0, 2.0, math.nan, 0.0, 0.0, 0.0]):
        with pytest.raises(ValueError, match="six finite numbers"):
            read_body_state(Message(data=data), 0.0)
