"""A fleet of both kinds in one world: `launch/fleet.launch`, and the figures of docs/scaling.md."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
import yaml
from simulation import scaling_figures
from telepresence_ros.robot_state import read_joints

from telepresence.sim.simulation import parse_robots

ROOT = Path(__file__).resolve().parents[3]


def roslaunch(environment: dict[str, str], option: str, *settings: str) -> str:
    """What roslaunch says it would do."""
    words = ["roslaunch", option, str(ROOT / "launch" / "fleet.launch"), *settings]
    return subprocess.run(words, env=environment, capture_output=True, text=True, check=True, timeout=60).stdout


def test_every_robot_of_a_fleet_has_drivers_in_a_namespace_of_its_own(workspace_environment):
    nodes = roslaunch(workspace_environment, "--nodes", "n:=5", "kind:=mixed").split()
    assert nodes.count("/robot_control_node") == 1, "one world"
    for name in ("pepper_1", "pepper_2"):
        assert {f"/{name}/naoqi_driver", f"/{name}/drive_server"} <= set(nodes)
    for name in ("robotino_1", "robotino_2", "robotino_3"):
        assert {f"/{name}/rto_core", f"/{name}/rto_odometry", f"/{name}/safe_omni_drive"} <= set(nodes)
    assert len(nodes) == len(set(nodes)) and not any("_4" in node for node in nodes)


@pytest.mark.parametrize(
    ("robot", "publisher", "frames"),
    [
        ("robotino_2", "rto_publisher", ("base_link", "distance_sensors_link", "camera_optical_frame", "laser_link")),
        (
            "pepper_2",
            "pepper_publisher",
            ("base_link", "base_footprint", "CameraTop_optical_frame", "SonarFront_frame"),
        ),
    ],
)
def test_the_frames_of_every_robot_are_in_its_own_tree(workspace_environment, robot, publisher, frames):
    words = ("n:=4", "kind:=mixed")
    assert f"/{robot}/{publisher}" in roslaunch(workspace_environment, "--nodes", *words).split()
    description = roslaunch(workspace_environment, "--dump-params", *words)
    joints = read_joints(yaml.safe_load(description)[f"/{robot}/robot_description"])
    assert set(frames) <= {name for joint in joints for name in (joint.parent, joint.child)}
    assert publisher not in roslaunch(workspace_environment, "--nodes", *words, "bodies:=false")


def test_the_simulator_is_told_of_all_of_them(workspace_environment):
    parameters = roslaunch(workspace_environment, "--dump-params", "n:=5", "kind:=mixed", "robotino_ports:=8200")
    words = re.search(r"/robot_control_node/robots: (.*)", parameters).group(1).split()
    assert [(request.name, request.port) for request in parse_robots(words)] == [
        *(("pepper_1", 9601), ("pepper_2", 9602)),
        *(("robotino_1", 8200), ("robotino_2", 8201), ("robotino_3", 8202)),
    ]


def test_the_figures_of_the_page_on_scaling_are_those_of_the_benchmark():
    page = (ROOT / "docs" / "scaling.md").read_text()
    figures = json.loads((ROOT / "docs" / "measured" / "scaling.json").read_text())
    assert {"fleet", "bandwidth"} <= set(figures)
    assert scaling_figures.filled(page, figures) == page
