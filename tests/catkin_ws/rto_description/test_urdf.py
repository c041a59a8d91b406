import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from telepresence_ros.robot_state import read_joints

URDF = Path(__file__).resolve().parents[3] / "catkin_ws/src/rto_description/urdf/robotino.urdf"


@pytest.fixture(scope="module")
def robot():
    return ElementTree.parse(URDF).getroot()


def joint(robot, name):
    found = robot.find(f"joint[@name='{name}']")
    origin = found.find("origin")
    texts = ["0 0 0" if origin is None else origin.get(part, "0 0 0") for part in ("xyz", "rpy")]
    return [[float(value) for value in text.split()] for text in texts]


def test_is_one_tree(robot):
    links = {link.get("name") for link in robot.findall("link")}
    children = [j.find("child").get("link") for j in robot.findall("joint")]
    parents = {j.find("parent").get("link") for j in robot.findall("joint")}
    assert len(children) == len(set(children)) and links - set(children) == {"base_link"}
    assert parents <= links


@pytest.mark.parametrize("i", range(9))
def test_infrared_sensors_look_outward_every_40_degrees(robot, i):
    xyz, rpy = joint(robot, f"infrared{i}_joint")
    bearing = math.radians(40 * i)
    assert xyz == pytest.approx([0.2264 * math.cos(bearing), 0.2264 * math.sin(bearing), 0.0566], abs=1e-4)
    assert math.remainder(rpy[2] - bearing, math.tau) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize(("i", "degrees"), [(0, 60), (1, 180), (2, 300)])
def test_wheels_stand_where_the_controller_says(robot, i, degrees):
    xyz, rpy = joint(robot, f"wheel{i}_joint")
    assert xyz == pytest.approx(
        [0.175 * math.cos(math.radians(degrees)), 0.175 * math.sin(math.radians(degrees)), 0.06], abs=1e-4
    )
    assert math.remainder(rpy[2] - math.radians(degrees), math.tau) == pytest.approx(0.0, abs=1e-5)


def test_camera_looks_ahead(robot):
    assert joint(robot, "camera_joint")[0] == [0.11, 0.0, 0.303]
    assert joint(robot, "camera_optical_joint")[1] == pytest.approx([-math.pi / 2, 0, -math.pi / 2], abs=1e-5)


@pytest.mark.parametrize(
    ("other", "ours"),
    [
        ("hokuyo_link", "laser_link"),
        ("laser", "laser_link"),
        ("camera_rgb_frame", "camera_link"),
        ("camera_rgb_optical_frame", "camera_optical_frame"),
    ],
)
def test_the_frames_of_rto_core_are_where_ours_are(robot, other, ours):
    assert {other, ours} <= {joint.child for joint in read_joints(URDF.read_text())}
    assert from_base(robot, other) == from_base(robot, ours)


@pytest.mark.parametrize("name", ["rto-1", "rto-2", "rto-3"])
def test_the_robots_of_rto_core_have_a_body(name):
    """Launch files read it by textfile=."""
    assert (URDF.parent / "robots" / f"{name}.urdf").read_text() == URDF.read_text()


def from_base(robot, link):
    """The shifts and turns that are not zero on the way from base_link."""
    parents = {j.find("child").get("link"): j for j in robot.findall("joint")}
    way = []
    while link in parents:
        step = joint(robot, parents[link].get("name"))
        way = [step, *way] if any(map(any, step)) else way
        link = parents[link].find("parent").get("link")
    return way
