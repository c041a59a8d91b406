import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

URDF = Path(__file__).resolve().parents[3] / "catkin_ws/src/rto_description/urdf/robotino.urdf"


@pytest.fixture(scope="module")
def robot():
    return ElementTree.parse(URDF).getroot()


def joint(robot, name):
    found = robot.find(f"joint[@name='{name}']")
    origin = found.find("origin")
    return [[float(v) for v in origin.get(part, "0 0 0").split()] for part in ("xyz", "rpy")]


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
