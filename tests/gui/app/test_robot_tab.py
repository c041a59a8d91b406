"""What one robot's part of the window remembers."""

import argparse

import pytest

from gui.app.controller import Attach
from gui.app.robot_tab import RobotTab
from gui.robots import ROBOTS
from gui.ros.node import RosNode
from gui.settings import Settings


@pytest.fixture
def make_tab(qt, tmp_path):
    """A tab as it is when the window opens, without a ROS master."""
    arguments = argparse.Namespace(gamepad="none", attach=Attach.NEVER, sign_in=False, folder=tmp_path)

    def make(settings):
        tab = RobotTab(RosNode(), ROBOTS["robotino"], "192.168.0.1", arguments)
        tab.restore(settings)
        return tab

    return make


@pytest.mark.parametrize("choice", [True, False])
def test_the_choice_of_the_careful_scan_is_remembered(make_tab, tmp_path, choice):
    settings = Settings(tmp_path / "window.ini")
    first = make_tab(settings)
    assert first.window.gate.careful_choice is None, "nobody has chosen"
    first.save(settings)
    assert make_tab(settings).window.gate.careful_choice is None
    first.window.gate.careful_choice = choice
    first.save(settings)
    settings.close()
    assert make_tab(Settings(tmp_path / "window.ini")).window.gate.careful_choice is choice
