"""The driver's figures of Pepper are those of the gate's profile and of the URDF."""

import csv
from pathlib import Path

import pytest
from naoqi_driver.robot_facts import FRONT, LEFT, LINE_WIDTH, MAX_RANGE, MIN_RANGE, RIGHT, SEGMENTS

from telepresence.safety import PEPPER

FRAMES = Path(__file__).resolve().parents[3] / "catkin_ws/src/pepper_description/data/frames.csv"
PROFILE = {source.name: source for source in PEPPER.sources}


@pytest.mark.parametrize(("name", "frame"), [("front laser", FRONT), ("left laser", LEFT), ("right laser", RIGHT)])
def test_the_gates_profile_has_the_same_lasers(name, frame):
    laser = PROFILE[name]
    assert laser.beams == SEGMENTS and (laser.min_range, laser.max_range) == (MIN_RANGE, MAX_RANGE)
    assert laser.origins[0] == pytest.approx((frame.x, frame.y))
    assert laser.bearings.mean() == pytest.approx(frame.theta)
    assert abs(laser.bearings[0] - laser.bearings[-1]) <= LINE_WIDTH + 1e-9


@pytest.mark.parametrize("frame", [FRONT, LEFT, RIGHT])
def test_the_urdf_has_the_same_frames(frame):
    with FRAMES.open() as file:
        rows = {row[0]: row for row in csv.reader(file)}
    _, _, x, y, _, _, _, yaw = rows[frame.frame_id]
    assert (float(x), float(y), float(yaw)) == (frame.x, frame.y, frame.theta)
