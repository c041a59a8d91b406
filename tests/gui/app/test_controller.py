"""What the buttons do and the indicators say."""

import itertools
import time

import pytest
from fake_window_parts import RUNNING, begun, picture
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QLabel, QPushButton

from gui.app.controller import PRESS_AGAIN, Attach
from gui.driving.drive_coordinator import STOP_REPEATS
from gui.driving.key_legend import IN_WINDOW
from gui.ros.readings import DriveState
from gui.terminal.commands import KEYBOARD, OPEN_TO_ALL, QUIET
from gui.widgets.picture_patience import MOST_PATIENCE
from gui.window import style_sheet
from telepresence.teleop.looking import HeadState

ZERO = (0.0, 0.0, 0.0)
LAUNCH = "roslaunch pepper_bringup tele_pepper.launch nao_ip:=127.0.0.1 roscore_ip:=127.0.0.1"
SECOND_NAME = "name:=teleop_twist_keyboard_2"


def click(button):
    QTest.mouseClick(button, Qt.LeftButton)


def test_without_a_master_the_window_says_what_to_do(open_window):
    window = open_window()
    assert "No ROS master answers at http://127.0.0.1:11311" in window.status.message
    assert "Roscore start" in window.status.message
    assert window.status.chip("master") == ("No ROS master", "bad")


def test_roscore_start_types_what_the_report_types(open_window, terminal, link):
    window = open_window()
    window.address.setText("127.0.0.1")
    click(window.roscoreButton)
    assert terminal.lines == [("roscore", "roscore")]
    assert "ROS master is being started" in window.status.message
    link.become(master=True)
    assert terminal.lines[1:] == [("session", f"{LAUNCH} {QUIET} {OPEN_TO_ALL}")]
    assert "starting" in window.status.message and "then press Session start" in window.status.message


def test_roscore_start_beside_a_running_master_types_the_launch_alone(open_window, terminal, link):
    window = open_window(Attach.NEVER)
    window.address.setText("127.0.0.1")
    link.become(master=True)
    click(window.roscoreButton)
    assert terminal.lines == [("session", f"{LAUNCH} {QUIET} {OPEN_TO_ALL}")]


def test_roscore_start_beside_running_programs_only_says_so(open_window, terminal, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.roscoreButton)
    assert terminal.lines == [] and "run already" in window.status.message


@pytest.mark.parametrize(
    "order", itertools.permutations(("roscoreButton", "sessionButton", "feedButton")), ids="-".join
)
def test_the_reports_buttons_bring_everything_up_in_any_order(open_window, terminal, link, order, spin):
    window = open_window()
    window.address.setText("127.0.0.1")
    for name in order:
        before = window.status.message
        click(getattr(window, name))
        assert window.status.message != before or name == "roscoreButton", f"{name} says nothing"
    link.become(master=True, joined=True)
    assert terminal.lines[-1] == ("session", f"{LAUNCH} {QUIET} {OPEN_TO_ALL}")
    terminal.running = "roslaunch"
    link.become(**RUNNING)
    link.picture.emit(picture())
    spin(lambda: begun(link) == {"show_page": True, "conversation": True}, "the conversation begins")
    assert link.watching and [line for line in terminal.lines if "roslaunch" in line[1]] == terminal.lines[-1:]
    assert "Conversation: the picture, you on the robot's tablet, sound." in window.status.message


def test_each_button_in_the_reports_order_says_what_it_did(open_window, terminal, link, spin):
    window = open_window()
    window.address.setText("127.0.0.1")
    click(window.roscoreButton)
    link.become(master=True, joined=True)
    terminal.running = "roslaunch"
    link.become(**RUNNING)
    assert "Press Session start" in window.status.message
    click(window.sessionButton)
    assert window.status.message.startswith(
        "Connected to Pepper: camera, laser, battery, safety gate, tablet page, sound."
    )
    assert begun(link) == {}, "people near the robot are neither seen nor heard before Robot feed"
    click(window.feedButton)
    spin(lambda: begun(link) == {"show_page": True, "conversation": True}, "the conversation begins")
    click(window.feedButton)
    spin(lambda: begun(link) == {"show_page": False, "conversation": False}, "and ends")


def test_a_robot_that_does_not_answer_is_said(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    link.channel("drive_state").arrived.emit(DriveState("robot unreachable: no route", 0.0))
    click(window.sessionButton)
    assert "Pepper does not answer" in window.status.message and "no route" in window.status.message


def test_session_start_brings_the_programs_up_and_connects(open_window, terminal, link):
    window = open_window()
    window.address.setText("127.0.0.1")
    link.become(master=True)
    click(window.sessionButton)
    assert terminal.lines == [("session", f"{LAUNCH} {QUIET} {OPEN_TO_ALL}")]
    terminal.running = "roslaunch"
    click(window.sessionButton)
    assert len(terminal.lines) == 1 and "this window connects when they answer" in window.status.message
    link.become(**RUNNING)
    assert "Connected to Pepper" in window.status.message


def test_a_wrong_address_is_marked_and_explained(open_window, terminal):
    window = open_window()
    window.address.setText("192.168.1.")
    click(window.sessionButton)
    assert terminal.lines == []
    assert window.address.property("invalid") and "host name" in window.status.message
    window.address.setText("127.0.0.1")
    assert not window.address.property("invalid")


def test_running_programs_are_joined(open_window, link, terminal):
    window = open_window()
    link.become(master=True, joined=True)
    assert not link.watching and terminal.lines == []
    link.become(**RUNNING)
    assert link.watching and window.feedButton.isChecked()
    assert terminal.lines == [("session", KEYBOARD)]
    link.become(master=False)
    link.become(**RUNNING)
    assert terminal.lines == [("session", KEYBOARD)], "joined once"


def test_running_programs_are_left_alone_when_asked(open_window, link, terminal):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    assert not link.watching and terminal.lines == []
    assert "Press Session start" in window.status.message


def test_attach_needs_only_a_master(open_window, link, terminal):
    open_window(Attach.ALWAYS)
    link.become(master=True)
    assert terminal.lines == [("session", KEYBOARD)]


def test_programs_started_by_the_button_are_not_joined_again(open_window, link, terminal):
    window = open_window()
    link.become(master=True)
    click(window.sessionButton)
    terminal.running = "roslaunch"
    link.become(**RUNNING)
    assert len(terminal.lines) == 1 and not link.watching


def test_session_start_beside_running_programs_starts_the_keyboard(open_window, link, terminal):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.sessionButton)
    assert terminal.lines == [("session", KEYBOARD)]


def test_a_keyboard_that_runs_elsewhere_is_not_thrown_out(open_window, link, terminal):
    open_window()
    link.become(**RUNNING, keyboards=frozenset({"/teleop_twist_keyboard"}))
    assert terminal.lines == [("session", f"{KEYBOARD} {SECOND_NAME}")]


@pytest.mark.parametrize(
    ("part", "last", "again"),
    [
        ("window terminal", KEYBOARD, [("session", KEYBOARD)]),
        ("window terminal", f"{KEYBOARD} {SECOND_NAME}", [("session", f"{KEYBOARD} {SECOND_NAME}")]),
        ("window terminal", "rostopic list", []),
        ("window terminal reaper", KEYBOARD, []),
    ],
)
def test_the_keyboard_is_back_in_the_place_of_a_terminal_that_died(open_window, link, terminal, part, last, again):
    open_window()
    link.become(**RUNNING)
    terminal.typed.emit(KEYBOARD)
    terminal.typed.emit(last)
    terminal.lines.clear()
    terminal.failed.emit(part, "died", "opens again")
    terminal.ready.emit()
    assert terminal.lines == again
    terminal.ready.emit()
    assert terminal.lines == again, "a terminal that a person opens again gets nothing"


def test_robot_feed_switches_the_picture_on_and_off(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.feedButton)
    assert link.watching
    link.picture.emit(picture())
    assert window.status.chip("picture") == ("Picture", "good")
    click(window.feedButton)
    assert not link.watching and window.video.age() == float("inf")
    assert window.status.chip("picture") == ("Feed off", "off")


def test_a_lost_picture_stops_the_pad_and_is_said(open_window, link, spin):
    window = open_window()
    link.become(**RUNNING)
    link.picture.emit(picture())
    window.setFocus()
    QTest.keyPress(window, Qt.Key_W)
    assert link.driven[-1] == (0.2, 0.0, 0.0)
    link.picture.emit(picture(age=3.0))
    spin(lambda: link.driven[-1] == ZERO, "the pad stops")
    spin(lambda: window.status.chip("picture") == ("Picture lost", "bad"), "the window says so")
    count = len(link.driven)
    QTest.keyPress(window, Qt.Key_A)
    assert len(link.driven) == count and "picture is lost" in window.status.message
    link.picture.emit(picture())
    QTest.keyPress(window, Qt.Key_S)
    assert link.driven[-1] == (-0.2, 0.0, 0.0)


def test_stop_of_a_window_without_the_robot_lets_keyboards_let_go_and_says_what_does_more(open_window, link):
    window = open_window()
    link.become(**RUNNING)
    link.report_lease(pilot="ben", window="/other")
    count = len(link.sent)
    QTest.keyPress(window, Qt.Key_Space)
    assert "zero" in [name for name, *_ in link.sent[count:]], "it goes past drive_lease"
    assert "Esc stops it" in window.status.message


@pytest.mark.parametrize("state", [{}, {"master": True}, {"master": True, "joined": True}])
def test_the_pad_says_why_it_cannot_drive(open_window, link, state):
    window = open_window(Attach.NEVER)
    link.become(**state)
    QTest.keyPress(window, Qt.Key_W)
    assert link.driven == [] and "Press " in window.status.message


def test_a_lost_master_stops_the_pad(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    QTest.keyPress(window, Qt.Key_W)
    trip = window.controller.views._round_trip
    assert trip.waiting(time.monotonic() + 5.0) > 5.0, "an answer is due"
    link.become()
    assert link.driven[-1] == ZERO
    assert trip.waiting(time.monotonic() + 5.0) == 0.0, "none is: that master is gone, the link is not slow"


def test_stop_sends_zero_for_a_while_and_interrupts_the_session(open_window, link, terminal, spin):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.stopButton)
    assert set(link.driven) == {ZERO} and terminal.interrupted == ["session"]
    spin(lambda: link.sent.count(("zero",)) == STOP_REPEATS, "zero is repeated")
    QTest.qWait(250)
    assert link.sent.count(("zero",)) == STOP_REPEATS and set(link.driven) == {ZERO}


def test_stop_says_when_everything_has_ended(open_window, link, terminal):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.stopButton)
    assert window.status.message.startswith("Stopping") and link.tidied, "the master forgets what had to be killed"
    terminal.ended.emit("")
    assert window.status.message.startswith("Stopping"), "a driver is still there"
    for button in (window.roscoreButton, window.sessionButton):
        click(button)
        assert "still ending" in window.status.message and terminal.lines == [], (
            "programs that end are not connected with"
        )
    link.become(master=True, joined=True)
    assert window.status.message.startswith("Stopped") and "Roscore start" in window.status.message


def test_stop_says_what_goes_on_elsewhere(open_window, link, terminal):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.stopButton)
    link.looked.emit()
    terminal.ended.emit("")
    link.looked.emit()
    assert window.status.message.startswith("Stopping"), "this answer may be older than the end"
    link.looked.emit()
    assert "run elsewhere and go on" in window.status.message


def test_a_program_that_does_not_end_is_said(open_window, link, terminal):
    window = open_window(Attach.NEVER)
    click(window.stopButton)
    terminal.ended.emit("roslaunch")
    assert "roslaunch still runs" in window.status.message


def test_driving_after_stop_is_not_overruled_by_its_zeros(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.stopButton)
    count = len(link.driven)
    QTest.keyPress(window, Qt.Key_W)
    QTest.qWait(250)
    assert ZERO not in link.driven[count:]


def test_the_terminal_taking_the_keyboard_stops_the_pad(open_window, link, terminal):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    QTest.keyPress(window, Qt.Key_W)
    terminal.take_keyboard()
    assert link.driven[-1] == ZERO
    assert window.status.chip("keys") == ("Keys: terminal", "warn")


def test_no_key_is_shown_as_driving_while_it_does_not(open_window, link, terminal):
    """One keypress, one meaning: W is either on the pad and drives, or covered by where it goes instead."""
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    assert window.pad.keys_note == "" and window.status.chip("keys") == ("Keys: drive pad", "good")
    terminal.take_keyboard()
    assert "terminal" in window.pad.keys_note and "F6" in window.pad.keys_note
    assert window.terminalLabel.text().startswith("Keys go to the terminal: i j l ,")
    click(window.sessionButton)
    assert not terminal.has_keyboard and window.pad.keys_note == "", "whoever presses a button looks at the window"
    QTest.keyPress(window.focusWidget() or window, Qt.Key_W)
    assert link.driven[-1] == (0.2, 0.0, 0.0)
    QTest.keyRelease(window.focusWidget() or window, Qt.Key_W)
    window.address.setFocus()
    assert "text field" in window.pad.keys_note and window.status.chip("keys")[0] == "Keys: text field"
    window.pad.setFocus()
    assert window.pad.keys_note == ""


def test_it_does_not_say_that_keys_drive_while_nobody_may(open_window, link):
    window = open_window()
    link.become(**RUNNING)
    link.picture.emit(picture())
    assert window.status.message.startswith("Ready: W A S D")
    link.report_lease(pilot="", window="")
    assert window.status.message == "Nobody drives. Press Take the robot."
    link.report_lease(pilot="anna", window=link.node_name)
    assert window.status.message.startswith("Ready: W A S D")


def test_the_keys_are_pictured_until_the_robot_is(open_window, link, spin):
    window = open_window()
    window.setStyleSheet(style_sheet("dark"))
    window.resize(1280, 720)
    spin(window.keys.isVisible, "the keys are seen in a window of the usual size")
    assert window.pad.key_rows == IN_WINDOW.rows, "as on the pad"
    window.pad.findChild(QPushButton, "pad_left").hide()
    window.controller.keys.show()
    legends = [label for label in window.keys.window_keys.findChildren(QLabel) if "<b>A</b>" in label.text()]
    assert not any(label.isVisible() for label in legends), "a key that does nothing is not pictured"
    link.become(**RUNNING)
    link.picture.emit(picture())
    assert not window.keys.isVisible()
    click(window.feedButton)
    assert window.keys.isVisible()


def test_what_the_terminal_refuses_is_said(open_window, terminal):
    window = open_window()
    terminal.refused.emit("roslaunch runs in the terminal's window 'session'.")
    assert window.status.message.startswith("roslaunch runs")


def test_a_picture_that_cannot_be_shown_is_said(open_window, link):
    window = open_window()
    link.become(**RUNNING)
    link.picture.emit(picture(encoding="yuv422", channels=2))
    assert "yuv422" in window.status.message


def test_a_click_on_a_button_leaves_the_space_bar_to_the_pad(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.feedButton)
    QTest.keyPress(window.focusWidget() or window, Qt.Key_Space)
    assert set(link.driven) == {ZERO} and window.feedButton.isChecked()


def test_fits_a_small_screen(open_window):
    window = open_window()
    assert window.minimumSizeHint().width() <= 1280 and window.minimumSizeHint().height() <= 720
    window.resize(1280, 720)
    assert (window.width(), window.height()) == (1280, 720)


def test_an_unknown_theme_names_the_known_ones():
    with pytest.raises(ValueError, match=r"known: .*dark"):
        style_sheet("pink")


def test_a_slow_link_halves_the_speed_and_a_very_slow_one_stops(open_window, link, spin):
    window = open_window()
    link.become(**RUNNING)
    views = window.controller.views

    def late(seconds):
        def told():
            views._delay_limit.note_command(seconds, time.monotonic())
            return window.controller.driving._share == (1.0 if seconds < 0.5 else 0.5 if seconds < 1.0 else 0.0)

        spin(told, f"{seconds} s are noticed")

    QTest.keyPress(window, Qt.Key_W)
    assert link.driven[-1] == pytest.approx((0.2, 0.0, 0.0))
    late(0.7)
    spin(lambda: link.driven[-1] == pytest.approx((0.1, 0.0, 0.0)), "half speed")
    late(1.2)
    assert link.driven[-1] == ZERO and "late" in window.controller.driving.mux.block
    late(0.1)
    assert not window.controller.driving.mux.block
    QTest.keyRelease(window, Qt.Key_W)


def test_a_late_picture_makes_the_robot_stand_and_the_next_one_lets_it_drive_on(open_window, link, spin):
    window = open_window()
    link.become(**RUNNING)
    link.picture.emit(picture(age=0.3))
    window.setFocus()
    QTest.keyPress(window, Qt.Key_W)
    assert link.driven[-1] == (0.2, 0.0, 0.0), "there is no usual period yet"
    lost = []
    window.video.late_changed.connect(lambda late: lost.append(window.video.stale))
    for number in range(5):
        link.picture.emit(picture(age=0.25 - 0.05 * number))
    spin(lambda: link.driven[-1] == ZERO, "it stands")
    assert lost == [False], "before the picture counts as lost"
    command = [values[1] for name, *values in link.sent if name == "command"][-1]
    assert command.hold, "and keyboards elsewhere do not drive"
    count = len(link.driven)
    spin(lambda: len(link.driven) >= count + 3, "the key is still held")
    assert set(link.driven[count:]) == {ZERO}
    link.picture.emit(picture())
    spin(lambda: link.driven[-1] == (0.2, 0.0, 0.0), "it drives on")
    QTest.keyRelease(window, Qt.Key_W)


def test_the_robot_stands_at_once_when_the_cameras_program_is_killed(open_window, link, spin):
    window = open_window()
    link.become(**RUNNING)
    link.picture.emit(picture())
    window.setFocus()
    QTest.keyPress(window, Qt.Key_W)
    late = []
    window.video.late_changed.connect(lambda _late: late.append(window.video.age()))
    spin(lambda: window.controller.views._cameras, "the camera is connected")
    link.connected["picture"] = 0
    spin(lambda: link.driven[-1] == ZERO, "it stands")
    assert late[0] < MOST_PATIENCE, "although the picture is not late yet"
    link.connected["picture"] = 1
    spin(lambda: link.picture.emit(picture()) or link.driven[-1] == (0.2, 0.0, 0.0), "it drives on")
    QTest.keyRelease(window, Qt.Key_W)


@pytest.mark.parametrize("changes", [{"pilot": "", "window": ""}, {"stopped_by": "ben"}], ids=["lease", "red stop"])
def test_a_key_that_outlasts_a_block_is_told_why_and_then_to_be_pressed_again(open_window, link, spin, changes):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    click(window.feedButton)
    link.picture.emit(picture())
    QTest.keyPress(window.pad, Qt.Key_W)
    spin(lambda: link.driven and link.driven[-1] != ZERO, "it drives")
    link.report_lease(**changes)
    block = window.controller.driving.mux.block
    assert block and window.status.message.startswith(block)

    def says(sentence):
        link.picture.emit(picture())
        return window.status.message.startswith(sentence)

    link.report_lease(pilot="anna", window=link.node_name, stopped_by="")
    spin(lambda: says(PRESS_AGAIN), "it may drive again")
    QTest.keyRelease(window.pad, Qt.Key_W)
    spin(lambda: says("Ready"), "and then the keys drive")


def test_why_a_key_does_not_drive_stays_said_when_it_is_let_go(open_window, link, spin):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    link.report_lease(pilot="ben", window="/other")
    QTest.keyPress(window.pad, Qt.Key_W)
    assert window.status.message == "ben drives. Press Ask for it."
    QTest.keyRelease(window.pad, Qt.Key_W)
    spin(lambda: not window.pad.dropped, "the release is seen")
    assert window.status.message == "ben drives. Press Ask for it."


def test_a_held_head_that_is_let_go_of_says_why(open_window, link, spin):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)

    def report_head(problem: str) -> None:
        head = HeadState(0.0, 0.0, 2.0, -0.7, 0.6, 0.0, problem, time.monotonic())
        link.channel("head").arrived.emit(head)

    report_head("")
    QTest.keyPress(window.pad, Qt.Key_J)
    spin(lambda: any(name == "look" for name, *_ in link.sent), "the head turns")
    report_head("The robot sleeps.")
    spin(lambda: window.status.message == "The robot sleeps.", "it is said")
    QTest.keyRelease(window.pad, Qt.Key_J)
