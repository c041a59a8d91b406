"""The URDF is what its tables say, is one tree, and moves as the simulated robot does."""

from __future__ import annotations

import importlib.util
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

from pepper_sim.models import load_pepper

PACKAGE = Path(__file__).resolve().parents[3] / "catkin_ws" / "src" / "pepper_description"


@pytest.fixture(scope="module")
def urdf() -> ET.Element:
    return ET.parse(PACKAGE / "urdf" / "pepper.urdf").getroot()


def test_file_is_what_the_generator_writes():
    spec = importlib.util.spec_from_file_location("generate_urdf", PACKAGE / "scripts" / "generate_urdf.py")
    generator = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generator)
    assert generator.OUTPUT.read_text() == generator.generate()


def test_links_form_one_tree_below_base_link(urdf):
    links = [link.get("name") for link in urdf.iter("link")]
    assert len(links) == len(set(links))
    parents = {j.find("child").get("link"): j.find("parent").get("link") for j in urdf.findall("joint")}
    assert set(links) - set(parents) == {"base_link"}
    assert set(parents) | set(parents.values()) == set(links)


def test_joints_are_the_robots(urdf):
    moving = {j.get("name"): j for j in urdf.findall("joint") if j.get("type") != "fixed"}
    own = [name for name, joint in moving.items() if joint.find("mimic") is None]
    assert len(own) == 17 + 3
    assert len(moving) - len(own) == 2 * 14  # finger joints follow the hands
    limit = moving["HeadYaw"].find("limit")
    assert (float(limit.get("lower")), float(limit.get("upper"))) == (-2.08567, 2.08567)


def test_mass_is_that_of_the_robot(urdf):
    masses = [float(mass.get("value")) for mass in urdf.iter("mass")]
    assert sum(masses) == pytest.approx(28.681, abs=0.001)


def test_cameras_have_optical_frames(urdf):
    links = {link.get("name") for link in urdf.iter("link")}
    assert {f"Camera{place}_optical_frame" for place in ("Top", "Bottom", "Depth")} <= links


def test_colours_and_shapes_are_defined(urdf):
    defined = {material.get("name") for material in urdf.findall("material")}
    assert {material.get("name") for material in urdf.iter("material")} == defined
    assert not list(urdf.iter("mesh"))


class Kinematics:
    """Poses of links in base_link, from the URDF."""

    def __init__(self, urdf: ET.Element) -> None:
        self._joints = {joint.find("child").get("link"): joint for joint in urdf.findall("joint")}

    def pose(self, link: str, angles: dict[str, float]) -> np.ndarray:
        joint = self._joints.get(link)
        if joint is None:
            return np.eye(4)
        return self.pose(joint.find("parent").get("link"), angles) @ self._step(joint, angles)

    @staticmethod
    def _step(joint: ET.Element, angles: dict[str, float]) -> np.ndarray:
        origin = joint.find("origin")
        step = np.eye(4)
        step[:3, 3] = [float(part) for part in origin.get("xyz").split()]
        roll, pitch, yaw = (float(part) for part in origin.get("rpy").split())
        step[:3, :3] = about("z", yaw) @ about("y", pitch) @ about("x", roll)
        if joint.get("type") != "fixed":
            turn = np.eye(4)
            axis = "xyz"[joint.find("axis").get("xyz").split().index("1")]
            turn[:3, :3] = about(axis, angles.get(joint.get("name"), 0.0))
            step = step @ turn
        return step


def about(axis: str, angle: float) -> np.ndarray:
    """Rotation matrix about a coordinate axis."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array(
        {
            "x": ((1, 0, 0), (0, c, -s), (0, s, c)),
            "y": ((c, 0, s), (0, 1, 0), (-s, 0, c)),
            "z": ((c, -s, 0), (s, c, 0), (0, 0, 1)),
        }[axis]
    )


def test_heights_of_the_zero_posture(urdf):
    # Derived from pepper.urdf of ros-naoqi/pepper_robot: above the floor [m].
    kinematics = Kinematics(urdf)
    floor = kinematics.pose("base_footprint", {})
    heights = {"torso": 0.820, "Neck": 0.990, "CameraTop_frame": 1.153, "CameraDepth_frame": 1.109, "LShoulder": 0.907}
    for link, height in heights.items():
        above = np.linalg.inv(floor) @ kinematics.pose(link, {})
        assert above[2, 3] == pytest.approx(height, abs=0.001), link


def test_optical_frames_look_ahead_with_x_to_the_right(urdf):
    kinematics = Kinematics(urdf)
    optical = kinematics.pose("CameraTop_optical_frame", {})[:3, :3]
    assert optical[:, 2] == pytest.approx((1, 0, 0), abs=1e-5)
    assert optical[:, 0] == pytest.approx((0, -1, 0), abs=1e-5)


@pytest.fixture(scope="module")
def simulated() -> mujoco.MjModel:
    return load_pepper().compile()


@pytest.mark.parametrize("seed", range(5))
def test_moves_as_the_simulated_robot_does(urdf, simulated, seed):
    kinematics = Kinematics(urdf)
    rng = np.random.default_rng(seed)
    data = mujoco.MjData(simulated)
    angles = {}
    for joint in urdf.findall("joint"):
        limit = joint.find("limit")
        if joint.get("type") == "revolute" and joint.find("mimic") is None and not joint.get("name").endswith("Hand"):
            name = joint.get("name")
            angles[name] = rng.uniform(float(limit.get("lower")), float(limit.get("upper")))
            data.qpos[simulated.joint(name).qposadr[0]] = angles[name]
    mujoco.mj_kinematics(simulated, data)

    torso = data.body("torso")
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = torso.xmat.reshape(3, 3), torso.xpos
    links = {link.get("name") for link in urdf.iter("link")}
    compared = 0
    for kind, count in (("body", simulated.nbody), ("site", simulated.nsite)):
        for index in range(count):
            name = getattr(simulated, kind)(index).name
            if name not in links or name.endswith("gripper"):  # the simulated hand is one rigid flap
                continue
            element = getattr(data, kind)(name)
            expected = world @ kinematics.pose(name, angles)
            assert element.xpos == pytest.approx(expected[:3, 3], abs=1e-4), name
            assert element.xmat == pytest.approx(expected[:3, :3].ravel(), abs=1e-4), name
            compared += 1
    assert compared > 40
