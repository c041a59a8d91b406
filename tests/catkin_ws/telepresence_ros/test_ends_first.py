"""Which nodes are ended first: those whose end brings a robot to rest, and no others."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from telepresence_ros.supervisor import ENDS_FIRST

PACKAGES = Path(__file__).parents[3] / "catkin_ws" / "src"
DRIVING = {
    "naoqi_driver_py/launch/naoqi_driver.launch": {"drive_server", "naoqi_driver"},
    "rto_node/launch/rto_node.launch": {"rto_core", "rto_drive_link"},
    "rto_bringup/launch/onboard.launch": {"onboard_drive"},
}


def marked(launch: Path) -> set[str]:
    return {
        node.attrib["name"]
        for node in ElementTree.parse(launch).iter("node")
        if any(env.attrib == {"name": ENDS_FIRST, "value": "true"} for env in node.iter("env"))
    }


@pytest.mark.parametrize("launch", DRIVING)
def test_what_drives_a_robot_is_marked(launch):
    assert marked(PACKAGES / launch) == DRIVING[launch]


def test_nothing_else_is_marked():
    others = {
        str(path.relative_to(PACKAGES)): marked(path)
        for path in PACKAGES.glob("*/launch/*.launch")
        if str(path.relative_to(PACKAGES)) not in DRIVING
    }
    assert others and not any(others.values())
