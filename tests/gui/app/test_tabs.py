"""Two robots behind tabs, and the parts that join a robot to the window."""

import os
import sys

import numpy as np
import pytest
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest

from gui.app.capture import Capture
from gui.app.controller import Attach, Controller
from gui.app.robot_tab import AWAY
from gui.app.tabs import RobotTabs
from gui.ros.picture import Picture
from gui.window import OperatorWindow
from telepresence.teleop.lease_messages import PILOT, Account

RUNNING = {"master": True, "joined": True, "driver": True, "feed": True}


@pytest.fixture
def robots(qt, make_link, make_terminal):
    """Two pages with a controller each."""
    parts = []
    for _ in range(2):
        terminal, link = make_terminal(), make_link()
        page = OperatorWindow(terminal)
        controller = Controller(page, link, terminal, Attach.NEVER)
        controller.admit(Account("anna", PILOT))
        parts.append((page, link, controller))
    return parts


@pytest.fixture
def tabs(robots, spin):
    tabs = RobotTabs([("Pepper", robots[0][0]), ("Robotino", robots[1][0])])

    def change(chosen):
        for index, (_, _, controller) in enumerate(robots):
            controller.driving.set_away("tab", "" if index == chosen else AWAY)

    tabs.changed.connect(change)
    change(0)
    tabs.show_on_screen()
    spin(tabs.isActiveWindow, "the window is active")
    for _, link, _ in robots:
        link.become(**RUNNING)
    yield tabs
    tabs.close()
    tabs.deleteLater()


def test_every_page_shows_all_robots_and_its_own_chosen(tabs):
    assert [bar.tabText(0) for bar in tabs._tabs] == ["Pepper", "Pepper"]
    tabs.choose(1)
    assert [bar.currentIndex() for bar in tabs._tabs] == [1, 1]
    assert tabs.pages[1].isVisible() and not tabs.pages[0].isVisible()


def test_a_click_on_a_tab_changes_the_robot(tabs):
    bar = tabs._tabs[0]
    QTest.mouseClick(bar, Qt.LeftButton, pos=bar.tabRect(1).center())
    assert tabs.current == 1 and tabs.pad is tabs.pages[1].pad


def test_ctrl_and_a_number_choose_a_robot(tabs):
    QTest.keyClick(tabs, Qt.Key_2, Qt.ControlModifier)
    assert tabs.current == 1
    QTest.keyClick(tabs, Qt.Key_1, Qt.ControlModifier)
    assert tabs.current == 0


def test_a_gamepad_restarts_and_stops_only_what_is_in_front(tabs, robots):
    (_, first, controller), (_, second, behind) = robots
    second.report_lease(pilot="ben", window="/other")
    for each in (controller, behind):
        each.gamepad.stop_pressed.emit()
        each.gamepad.restart_wanted.emit()
    assert set(first.driven) == {(0.0, 0.0, 0.0)} and ("restart_simulation",) in first.called
    assert second.driven == [] and ("restart_simulation",) not in second.called


def test_keys_drive_only_the_robot_in_front(tabs, robots, spin):
    (_, first, _), (_, second, _) = robots
    tabs.choose(1)
    QTest.keyPress(tabs.pages[1], Qt.Key_W)
    spin(lambda: any(any(velocity) for velocity in second.driven), "the robot in front drives")
    assert not any(any(velocity) for velocity in first.driven)
    tabs.choose(0)
    spin(lambda: second.driven[-1] == (0.0, 0.0, 0.0), "changing the robot stops it")
    QTest.keyRelease(tabs.pages[0], Qt.Key_W)
    assert AWAY in robots[1][2].driving.mux.block


def test_exit_closes_the_whole_window(tabs):
    tabs.pages[0].exitButton.click()
    assert not tabs.isVisible()


def test_a_snapshot_is_the_robots_own_picture(qt, link, terminal, tmp_path):
    window = OperatorWindow(terminal)
    said = []
    capture = Capture(window, link, tmp_path / "kept")
    capture.said.connect(lambda text, level: said.append(text))
    window.snapshotButton.click()
    assert "no picture" in said[0]
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:, :, 0] = 200
    window.video.show_picture(Picture(pixels, "rgb8", 0.0, 0.0))
    window.snapshotButton.click()
    (kept,) = (tmp_path / "kept").glob("*.png")
    assert qt is not None and "Saved" in said[1] and kept.stat().st_size > 100


def test_recording_without_a_master_is_refused_in_words(qt, link, terminal, tmp_path):
    window = OperatorWindow(terminal)
    said = []
    capture = Capture(window, link, tmp_path)
    capture.said.connect(lambda text, level: said.append(text))
    window.recordButton.click()
    assert "no ROS master" in said[0] and not window.recordButton.isChecked() and not capture.recorder.recording


def test_a_folder_that_cannot_be_made_is_told(qt, link, terminal, tmp_path):
    (tmp_path / "file").write_text("")
    window = OperatorWindow(terminal)
    said = []
    capture = Capture(window, link, tmp_path / "file" / "below")
    capture.said.connect(lambda text, level: said.append(text))
    link.become(master=True)
    window.recordButton.click()
    assert "Nothing can be recorded" in said[0] and not window.recordButton.isChecked()


@pytest.fixture
def held_film(tmp_path, monkeypatch):
    """A rosrun whose bags end when they are interrupted, and whose films end when this file is gone, too; and a report
    that is ready at once."""
    held, program = tmp_path / "held", tmp_path / "programs" / "rosrun"
    program.parent.mkdir()
    report = program.with_name("report")
    report.write_text("#!/bin/sh\n")
    report.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(report))
    program.write_text(f"""\
#!/bin/sh
trap ended=1 INT
for file; do case $file in *.bag) break;; *.mp4) held={held}; break;; esac; done
: > "$file"
while [ -z "$ended" ] || [ -e "$held" ]; do sleep 0.02; done
""")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    held.touch()
    yield held
    held.unlink(missing_ok=True)


def test_record_pressed_while_the_last_recording_is_closed_is_refused_in_words(
    qt, link, terminal, tmp_path, held_film, spin
):
    window = OperatorWindow(terminal)
    said = []
    capture = Capture(window, link, tmp_path / "kept")
    capture.said.connect(lambda text, level: said.append(text))
    link.become(master=True)
    button = window.recordButton
    button.click()
    assert button.isChecked() and button.text() == "■ 0:00"
    spin(lambda: len([*(tmp_path / "kept").glob("*.[bm]*")]) == 2, "the recording has begun")
    button.click()
    assert not button.isChecked() and button.text() == "■ Closing"
    spin(lambda: any("Recorded" in text for text in said), "the bag is closed")
    assert button.text() == "■ Closing", "the camera is still filmed"
    button.click()
    assert "still being closed" in said[-1] and not button.isChecked() and button.text() == "■ Closing"
    held_film.unlink()
    spin(lambda: button.text() == "● Record", "the film is closed")
    button.click()
    assert button.isChecked() and button.text() == "■ 0:00"
    capture.recorder.close()
    assert not button.isChecked() and button.text() == "● Record"


def test_why_a_recording_ended_is_said_until_the_next_one(qt, link, terminal, tmp_path):
    """The bottom line shows one message, and the report's follows within seconds."""
    said = []
    capture = Capture(OperatorWindow(terminal), link, tmp_path)
    capture.said.connect(lambda *message: said.append(message))
    capture.recorder.failed.emit("The disk is full.")
    capture.recorder.finished.emit("session.bag")
    capture.recorder.reported.emit("session.html")
    assert said[0] == ("The disk is full.", "bad")
    assert said[-1] == ("The disk is full. The session's report: session.html", "bad")
