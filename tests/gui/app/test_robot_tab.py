"""What one robot's part of the window remembers."""

import argparse

import pytest

from gui.app.controller import Attach
from gui.app.robot_tab import RobotTab, bring_to_front, hand_on_conversations
from gui.robots import ROBOTS
from gui.ros.node import RosNode
from gui.settings import Settings


@pytest.fixture
def make_tab(qt, tmp_path):
    """A tab as it is when the window opens, without a ROS master."""
    arguments = argparse.Namespace(gamepad="none", attach=Attach.NEVER, sign_in=False, folder=tmp_path, converse=False)

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


@pytest.mark.parametrize("muted", [True, False])
def test_a_conversation_goes_on_with_the_robot_in_front_and_who_was_muted_stays_muted(make_tab, tmp_path, muted):
    tabs = [make_tab(Settings(tmp_path / f"{index}.ini")) for index in range(2)]
    hand_on_conversations(tabs)
    bring_to_front(tabs, 0)
    tabs[0].controller.conversation.want(True)
    tabs[0].window.sound.microphone.setChecked(muted)
    other = tabs[1].controller.conversation
    wants, want = [], other.want
    other.want = lambda wanted, **how: (wants.append((wanted, how)), want(wanted, **how))
    bring_to_front(tabs, 1)
    assert [tab.controller.conversation.on for tab in tabs] == [False, True]
    assert wants == [(True, {"muted": muted})] and tabs[1].window.feedButton.isChecked(), "and is seen"
    bring_to_front(tabs, 0)
    assert [tab.controller.conversation.on for tab in tabs] == [True, False]


@pytest.mark.parametrize("at_first", ["muted", "ended"])
def test_who_came_to_both_robots_is_not_heard_at_the_second_one_against_their_will(make_tab, tmp_path, at_first):
    tabs = [make_tab(Settings(tmp_path / f"{index}.ini")) for index in range(2)]
    hand_on_conversations(tabs)
    bring_to_front(tabs, 0)
    for tab in tabs:
        tab.controller.conversation.greet()
    if at_first == "muted":
        tabs[0].window.sound.microphone.setChecked(True)
    else:
        tabs[0].controller.conversation.want(False)
    other = tabs[1].controller.conversation
    wants, want = [], other.want
    other.want = lambda wanted, **how: (wants.append((wanted, how)), want(wanted, **how))
    bring_to_front(tabs, 1)
    assert wants == ([(True, {"muted": True})] if at_first == "muted" else [])


def test_no_conversation_begins_because_a_robot_comes_to_the_front(make_tab, tmp_path):
    tabs = [make_tab(Settings(tmp_path / f"{index}.ini")) for index in range(2)]
    hand_on_conversations(tabs)
    for index in (0, 1, 0):
        bring_to_front(tabs, index)
        assert not any(tab.controller.conversation.on for tab in tabs)
