"""The window of a robot that takes movement_command alone, and what the other robots' windows report there."""

import time

import numpy as np
import pytest
from fake_window_parts import FakeLink
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QLabel

from gui.app.controller import Attach, Controller
from gui.robots import ROBOTS
from gui.ros.readings import TruePose
from gui.window import OperatorWindow
from telepresence.teleop.lease_messages import PILOT, WATCHER, Account
from telepresence.teleop.movement import only_reports

RUNNING = {"master": True, "joined": True, "driver": True, "feed": True}


@pytest.fixture
def open_window(qt, terminal, spin):
    opened = []

    def open_one(robot, role=PILOT):
        window = OperatorWindow(terminal)
        window.address.setText("127.0.0.1")
        window.link = FakeLink(robot)
        window.controller = Controller(window, window.link, terminal, Attach.AUTO)
        window.controller.admit(Account("anna", role))
        window.show_on_screen()
        opened.append(window)
        spin(window.isActiveWindow, "the window is active")
        window.link.become(**RUNNING)
        return window

    yield open_one
    for window in opened:
        window.close()
        window.deleteLater()


@pytest.fixture
def window(open_window):
    return open_window("walker")


def hold(window, spin, key):
    """Hold a key, and return what was sent until the stop behind it."""
    window.link.sent.clear()
    QTest.keyPress(window, key)
    QTest.keyRelease(window, key)
    spin(lambda: not window.pad._lifted and window.link.movements[-1:] in ([], [0]), "the release stops")
    return window.link.movements


def legend(window):
    """The letters in the picture of the window's keys."""
    caps = window.keys.window_keys.findChildren(QLabel)
    return [cap.text()[3] for cap in caps if cap.text().startswith("<b>") and not cap.isHidden()]


def test_what_the_walker_lacks_is_not_there(window, terminal):
    controls = window.controller.controls
    lacking = (window.around, window.gate, window.address, controls.speedSlider, controls.speedTitle)
    assert not any(widget.isVisible() for widget in lacking)
    assert controls.restartButton.isVisible() and window.bodyPanel.isVisible()
    assert [window.deck.tabText(index) for index in range(window.deck.count())] == ["Terminal", "Gamepad"]
    assert terminal.lines == [], "there is no keyboard program for it"
    assert window.keys.terminal_keys.isHidden() and legend(window) == ["W", "S"]
    assert window.link.watching, "the picture is shown"


def test_held_keys_walk_and_the_others_do_nothing(window, spin):
    assert hold(window, spin, Qt.Key_W) == [1, 0]
    assert hold(window, spin, Qt.Key_Down) == [2, 0]
    for key in (Qt.Key_Q, Qt.Key_A, Qt.Key_Right):
        assert hold(window, spin, key) == []
    window.controller.gamepad.velocity.emit(0.2, 0.0, 0.0)
    window.controller.gamepad.velocity.emit(0.0, 0.0, 0.0)
    assert window.link.movements == [1, 0]


def test_the_red_stop_is_repeated_until_it_is_let_go(window, spin):
    driving = window.controller.driving
    driving.red_stop()
    assert window.controller.controls.redStop.text().startswith("STOPPED by anna")
    window.link.sent.clear()
    spin(lambda: window.link.movements.count(0) > 2, "the stop is repeated")
    assert hold(window, spin, Qt.Key_W)[:1] != [1] and "red stop" in window.status.message
    driving.reset_red_stop()
    assert hold(window, spin, Qt.Key_W) == [1, 0]


def test_the_restart_button_and_session_start(window, terminal):
    QTest.mouseClick(window.controller.controls.restartButton, Qt.LeftButton)
    assert window.link.called == [("restart_simulation",)]
    QTest.mouseClick(window.sessionButton, Qt.LeftButton)
    assert terminal.lines == [] and not terminal.has_keyboard, "it runs already"
    window.link.become(master=True, joined=True)
    assert "The simulation does not run" in window.padLabel.toolTip()
    QTest.mouseClick(window.sessionButton, Qt.LeftButton)
    assert terminal.lines == [("session", "roslaunch sim_bringup walker_sim.launch")]
    assert not terminal.has_keyboard, "W is for the pad"


def test_a_watcher_watches_and_may_press_the_red_stop(open_window, spin):
    window = open_window("walker", WATCHER)
    assert hold(window, spin, Qt.Key_W) == [] and "may watch" in window.status.message
    window.controller.driving.red_stop()
    spin(lambda: window.link.movements.count(0) > 2, "it is stopped")
    window.controller.driving.reset_red_stop()
    assert window.controller.access.state.stopped_by == "anna", "who may not drive cannot reset it"


def test_body_state_is_written_with_all_six_numbers(window):
    window.bodyPanel.show_reading(TruePose(1.0, -0.5, 0.19, np.pi / 2, 0.0, -np.pi, time.monotonic()))
    assert dict(window.bodyPanel.lines()) == {
        "x": "+1.00 m", "y": "−0.50 m", "z": "+0.19 m", "roll": "+90.0°", "pitch": "+0.0°", "yaw": "−180.0°",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["pepper", "robotino"])
def test_a_window_that_drives_by_velocities_only_reports_its_movements(open_window, spin, name):
    window = open_window(name)
    assert hold(window, spin, Qt.Key_W)[0] == 1 and window.link.driven[0][0] == pytest.approx(0.2)
    assert hold(window, spin, Qt.Key_S)[0] == 2
    assert set(hold(window, spin, Qt.Key_Q)) == {0}, "turning has no number"
    row = next(row for row in ROBOTS[name].outgoing if row.channel == "movement")
    assert only_reports(row.headers or {}) and row.topic == "/movement_command"
    assert not only_reports({"callerid": "/gui_ros_node"})


def test_among_others_a_robots_simulated_topics_are_in_its_namespace():
    robotino = ROBOTS["robotino"].among_others()
    topics = {row.channel: row.topic for row in (*robotino.incoming, *robotino.outgoing)}
    assert (topics["true_pose"], topics["movement"], robotino.robot_camera) == (
        "body_state", "movement_command", "robot_camera",
    )  # fmt: skip


def test_robot_camera_can_be_chosen_when_a_simulator_publishes_it(open_window):
    window = open_window("pepper")
    choice = window.cameraChoice
    names = lambda: [choice.itemText(index) for index in range(choice.count())]  # noqa: E731
    before = names()
    window.link.become(**RUNNING, robot_camera=True)
    window.link.become(**RUNNING, robot_camera=True)
    assert names() == [*before, "robot_camera"]


def test_keys_as_in_the_guide_are_chosen_in_the_menu_with_its_speeds(open_window):
    window = open_window("robotino")
    controls, bar = window.controller.controls, window.controller.bar
    controls.set_speed(0.15)
    bar.set_guide_keys(True)
    assert (controls.speed, controls.turn) == pytest.approx((0.05, 0.05))
    assert legend(window) == ["E", "W", "Q", "A", "S", "D"]
    QTest.keyPress(window, Qt.Key_Q)
    assert window.link.driven[-1] == pytest.approx((0.0, 0.0, -0.05))
    QTest.keyRelease(window, Qt.Key_Q)
    bar.set_guide_keys(False)
    assert (controls.speed, controls.turn) == pytest.approx((0.15, 0.375))
