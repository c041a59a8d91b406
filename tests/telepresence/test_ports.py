"""The usual ports are the same in launch files, in what runs alone on a robot, and in `telepresence.ports`."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from naoqi_driver.onboard import drive_program
from rto_bringup.onboard import __main__ as robotino_onboard

import pepper_sim.simulation
from telepresence import ports
from telepresence.drive import datagram
from telepresence.naoqi import dial
from telepresence.station.launch_settings import OWN_SETTINGS, launch_arguments

ROOT = Path(__file__).parents[2]
PROGRAMS = [path for folder in ("launch", "catkin_ws/src") for path in sorted(ROOT.joinpath(folder).rglob("*.launch"))]
ARGUMENTS = {
    "nao_port": {ports.NAOQI},
    "pepper_drive_port": {ports.PEPPER_DRIVE},
    "drive_port": {ports.PEPPER_DRIVE, ports.ROBOTINO_DRIVE},
    "robot_page_port": {ports.OWNER_PAGE},
    "page_port": {ports.TABLET_PAGE},
    "rtp_port": {ports.RTP_SOUND},
    "pilot_page_port": {ports.PILOT_PAGE},
}


def defaults(name: str) -> set[int]:
    """The default of this argument in all launch files, where it has one of its own."""
    found = set()
    for path in PROGRAMS:
        for argument in ElementTree.parse(path).getroot().iter("arg"):
            number = re.search(r"(\d+)\)?$", argument.get("default", ""))
            if argument.get("name") == name and number:
                found.add(int(number[1]))
    return found


@pytest.mark.parametrize("name", ARGUMENTS)
def test_launch_files_have_the_same(name):
    assert defaults(name) == ARGUMENTS[name]


@pytest.mark.parametrize("name", ["launch/walker.launch", "catkin_ws/src/sim_bringup/launch/walker_sim.launch"])
def test_the_walkers_launch_files_have_the_same(name):
    port = ElementTree.parse(ROOT / name).getroot().find("arg[@name='port']")
    assert port.get("default") == str(ports.WALKER)


def test_what_runs_alone_has_the_same():
    assert drive_program.PORT == ports.PEPPER_DRIVE
    assert datagram.DEFAULT_PORT == robotino_onboard.DRIVE_PORT == ports.ROBOTINO_DRIVE
    assert robotino_onboard.CAMERA_PORT == ports.ROBOTINO_CAMERA
    assert robotino_onboard.SOUND_PORT == ports.ROBOTINO_SOUND
    assert pepper_sim.simulation.DEFAULT_PORT == dial.DEFAULT_PORT == ports.NAOQI


@pytest.mark.parametrize("robot", ["pepper", "robotino"])
def test_the_second_station_in_the_documentation_moves_every_port(robot):
    (line,) = re.findall(rf"^ROS_MASTER_URI=.* \./stack up {robot} (.*)", (ROOT / "docs/faults.md").read_text(), re.M)
    named = {word.partition(":=")[0] for word in line.split()}
    assert named == {name for name in {*launch_arguments(robot), *OWN_SETTINGS} if name.endswith("_port")}
