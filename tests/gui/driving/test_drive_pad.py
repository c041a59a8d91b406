"""Driving by held keys and buttons."""

import itertools
import math

import pytest
from PyQt5.QtCore import QEvent, Qt
from PyQt5.QtGui import QKeyEvent
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication, QLabel, QLineEdit, QPushButton

from gui.driving.drive_pad import MOVES, velocity_of
from telepresence.teleop.hand_speeds import USUAL_SPEED, USUAL_TURN

ZERO = (0.0, 0.0, 0.0)
FORWARD = (USUAL_SPEED, 0.0, 0.0)


@pytest.fixture
def window(make_pad_window):
    return make_pad_window(field=QLineEdit())


def press(window, key, modifiers=Qt.NoModifier):
    QTest.keyPress(QApplication.focusWidget() or window, key, modifiers)


def release(window, key):
    QTest.keyRelease(QApplication.focusWidget() or window, key)


def repeat(window, key):
    """What the keyboard sends while a key is held."""
    for kind in (QEvent.KeyRelease, QEvent.KeyPress):
        QApplication.sendEvent(window, QKeyEvent(kind, key, Qt.NoModifier, "", True))


@pytest.mark.parametrize(
    ("key", "velocity"),
    [
        (Qt.Key_W, (USUAL_SPEED, 0, 0)),
        (Qt.Key_S, (-USUAL_SPEED, 0, 0)),
        (Qt.Key_A, (0, USUAL_SPEED, 0)),
        (Qt.Key_D, (0, -USUAL_SPEED, 0)),
        (Qt.Key_Q, (0, 0, USUAL_TURN)),
        (Qt.Key_E, (0, 0, -USUAL_TURN)),
        (Qt.Key_Up, (USUAL_SPEED, 0, 0)),
        (Qt.Key_Down, (-USUAL_SPEED, 0, 0)),
        (Qt.Key_Left, (0, 0, USUAL_TURN)),
        (Qt.Key_Right, (0, 0, -USUAL_TURN)),
    ],
)
def test_keys(window, spin, key, velocity):
    press(window, key)
    assert window.sent == [velocity]
    release(window, key)
    spin(lambda: window.sent[-1] == ZERO, "the release sends zero")


def test_held_is_repeated_and_released_is_zero_once_and_then_quiet(window, spin, qt):
    press(window, Qt.Key_W)
    spin(lambda: len(window.sent) >= 4, "the command is repeated")
    release(window, Qt.Key_W)
    spin(lambda: window.sent[-1] == ZERO, "the release sends zero")
    QTest.qWait(300)
    assert window.sent.count(ZERO) == 1 and window.sent[-1] == ZERO


def test_auto_repeat_is_not_a_release(window, spin):
    press(window, Qt.Key_W)
    for _ in range(5):
        repeat(window, Qt.Key_W)
    spin(lambda: len(window.sent) >= 4, "the command is repeated")
    assert set(window.sent) == {FORWARD}


def test_a_torn_auto_repeat_is_not_a_release_either(window, spin):
    press(window, Qt.Key_W)
    release(window, Qt.Key_W)
    press(window, Qt.Key_W)
    spin(lambda: len(window.sent) >= 4, "the command is repeated")
    assert set(window.sent) == {FORWARD}


def test_the_mouse_drives(window, spin):
    cap = next(cap for cap in window.pad.findChildren(QPushButton) if "W" in cap.text())
    QTest.mousePress(cap, Qt.LeftButton)
    spin(lambda: len(window.sent) >= 3, "the command is repeated")
    QTest.mouseRelease(cap, Qt.LeftButton)
    assert window.sent[-1] == ZERO and set(window.sent) == {FORWARD, ZERO}


def test_letting_go_of_one_of_two_keys_keeps_the_other(window, spin):
    press(window, Qt.Key_W)
    press(window, Qt.Key_Q)
    assert window.sent[-1] == (USUAL_SPEED, 0.0, USUAL_TURN)
    release(window, Qt.Key_Q)
    spin(lambda: window.sent[-1] == FORWARD, "the other key goes on")
    assert ZERO not in window.sent


def test_space_stops_whatever_is_held(window, spin):
    press(window, Qt.Key_W)
    press(window, Qt.Key_Space)
    assert window.sent[-1] == ZERO and not window.pad.held
    release(window, Qt.Key_W)
    QTest.qWait(250)
    assert window.sent == [FORWARD, ZERO]


def test_losing_the_window_stops(window, spin):
    press(window, Qt.Key_W)
    QApplication.sendEvent(window, QEvent(QEvent.WindowDeactivate))
    assert window.sent[-1] == ZERO and not window.pad.held


def test_hiding_the_window_stops(window):
    press(window, Qt.Key_W)
    window.hide()
    assert window.sent[-1] == ZERO


def test_nothing_is_sent_when_nothing_was_held(window):
    window.pad.release_all()
    QApplication.sendEvent(window, QEvent(QEvent.WindowDeactivate))
    assert window.sent == []


def test_typing_a_text_does_not_drive(window):
    window.field.setFocus()
    QTest.keyClicks(window.field, "wasd qe")
    assert window.field.text() == "wasd qe" and window.sent == []


def test_shortcuts_do_not_drive(window):
    press(window, Qt.Key_Q, Qt.ControlModifier)
    assert window.sent == []


def test_a_blocked_pad_stops_and_says_why(window):
    reasons = []
    window.pad.blocked.connect(reasons.append)
    press(window, Qt.Key_W)
    window.pad.set_block("The picture is lost.")
    assert window.sent == [FORWARD, ZERO]
    press(window, Qt.Key_A)
    assert window.sent == [FORWARD, ZERO] and reasons == ["The picture is lost."]
    window.pad.set_block("")
    press(window, Qt.Key_S)
    assert window.sent[-1] == (-USUAL_SPEED, 0.0, 0.0)


def test_what_a_block_let_go_of_counts_as_dropped_until_it_is_released_or_pressed_again(window, spin):
    pad, changes = window.pad, []
    pad.dropped_changed.connect(lambda: changes.append(pad.dropped))
    press(window, Qt.Key_W)
    assert not pad.dropped
    pad.set_block("The picture is lost.")
    assert pad.dropped
    pad.set_block("")
    repeat(window, Qt.Key_W)
    assert pad.dropped and window.sent[-1] == ZERO, "the keyboard's repetition is no press"
    release(window, Qt.Key_W)
    spin(lambda: not pad.dropped, "it was released")
    pad.set_block("The picture is lost.")
    press(window, Qt.Key_A)
    assert pad.dropped, "it was pressed in vain"
    QApplication.sendEvent(window, QEvent(QEvent.WindowDeactivate))
    assert not pad.dropped, "nobody sees the release of another window's keys"
    assert changes == [True, False, True, False]


def test_a_key_that_was_lifted_when_driving_was_blocked_is_not_dropped(window):
    press(window, Qt.Key_W)
    release(window, Qt.Key_W)
    window.pad.set_block("The picture is lost.")
    assert not window.pad.dropped


def test_stop_works_on_a_blocked_pad(window):
    window.pad.set_block("The picture is lost.")
    press(window, Qt.Key_Space)
    assert window.sent == [ZERO]


def test_no_combination_is_faster_than_a_straight_line():
    for count in range(len(MOVES) + 1):
        for held in itertools.combinations(MOVES, count):
            x, y, theta = velocity_of(set(held))
            assert math.hypot(x, y) <= USUAL_SPEED * (1 + 1e-9) and abs(theta) <= USUAL_TURN


def test_opposites_cancel():
    assert velocity_of({"forward", "backward"}) == ZERO
    assert velocity_of({"turn_left", "turn_right", "left", "right"}) == ZERO


def test_a_key_that_is_held_while_a_field_gets_the_keyboard_does_not_go_on(window):
    press(window, Qt.Key_W)
    window.field.setFocus()
    assert window.sent[-1] == ZERO and not window.pad.held


def test_a_release_counts_wherever_the_keyboard_is(window, spin):
    press(window, Qt.Key_W)
    QApplication.sendEvent(window.field, QKeyEvent(QEvent.KeyRelease, Qt.Key_W, Qt.NoModifier))
    spin(lambda: window.sent[-1] == ZERO, "the release sends zero")


def test_a_dialog_stops(window):
    press(window, Qt.Key_W)
    QApplication.sendEvent(window, QEvent(QEvent.WindowBlocked))
    assert window.sent[-1] == ZERO


def test_keys_as_in_the_guide_turn_the_other_way(window, spin):
    window.pad.set_guide_keys(True)
    for key, wz in ((Qt.Key_Q, -USUAL_TURN), (Qt.Key_E, USUAL_TURN), (Qt.Key_Left, USUAL_TURN)):
        press(window, key)
        assert window.sent[-1] == (0.0, 0.0, wz)
        release(window, key)
        spin(lambda: window.sent[-1] == ZERO, "the release stops")
    letters = {cap.objectName(): cap.text()[-1] for cap in window.pad.findChildren(QPushButton)}
    assert letters["pad_turn_left"] == "E" and letters["pad_turn_right"] == "Q" and letters["pad_forward"] == "W"
    window.pad.set_guide_keys(False)
    press(window, Qt.Key_Q)
    assert window.sent[-1] == (0.0, 0.0, USUAL_TURN)


def test_a_robot_that_cannot_turn_is_not_offered_to(window, qt):
    window.pad.limit_to(("forward", "backward"))
    for key in (Qt.Key_Q, Qt.Key_A, Qt.Key_Right):
        press(window, key)
    assert window.sent == []
    shown = {cap.objectName() for cap in window.pad.findChildren(QPushButton) if cap.isVisible()}
    assert shown == {"pad_forward", "pad_backward", "padStop"}


def test_a_note_covers_the_keys_and_a_click_on_it_does_not_drive(window, spin):
    """Whoever reads where keys go instead must not start to drive by clicking there."""
    assert window.pad.keys_note == ""
    window.pad.set_keys_note("Keys go to the terminal.")
    note = next(child for child in window.pad.findChildren(QLabel) if child.text() == "Keys go to the terminal.")
    spin(note.isVisible, "the note is shown")
    forward = window.pad.findChild(QPushButton, "pad_forward")
    assert note.geometry().contains(forward.geometry())
    QTest.mouseClick(window.pad.childAt(forward.geometry().center()), Qt.LeftButton)
    assert window.sent == []
    window.pad.set_keys_note("")
    assert not note.isVisible()
    QTest.mousePress(window.pad.childAt(forward.geometry().center()), Qt.LeftButton)
    assert window.sent[-1] == FORWARD
    QTest.mouseRelease(forward, Qt.LeftButton)
