"""A key counts by its place on the keyboard where its letter does not say which it is."""

import pytest
from PyQt5.QtCore import QEvent, Qt
from PyQt5.QtGui import QKeyEvent
from PyQt5.QtWidgets import QApplication, QComboBox, QTabBar

from gui.driving.physical_keys import command_key
from telepresence.teleop.hand_speeds import USUAL_SPEED, USUAL_TURN

ZERO = (0.0, 0.0, 0.0)
W, E, S = 25, 26, 39
"""X's key codes."""
EURO, CYRILLIC_TSE, GREEK_SIGMA = 0x20AC, 0x426, 0x3A3


def key(kind, qt_key, code, modifiers=Qt.NoModifier):
    """An event as X sends it."""
    return QKeyEvent(kind, qt_key, modifiers, code, 0, 0, "", False, 1)


@pytest.fixture
def window(make_pad_window):
    tabs, choice = QTabBar(), QComboBox()
    choice.addItems(["Front", "Bottom"])
    for title in ("Pepper", "Robotino"):
        tabs.addTab(title)
    window = make_pad_window(tabs=tabs, choice=choice)
    window.stops = []
    window.pad.stop_pressed.connect(lambda: window.stops.append(True))
    return window


def send(window, *event, **more):
    QApplication.sendEvent(QApplication.focusWidget() or window, key(*event, **more))


def test_a_key_that_types_another_letter_when_it_comes_up_lets_go(window, spin):
    """On a German keyboard AltGr and E are the euro sign."""
    send(window, QEvent.KeyPress, Qt.Key_E, E)
    assert window.sent == [(0.0, 0.0, -USUAL_TURN)]
    send(window, QEvent.KeyRelease, EURO, E)
    spin(lambda: not window.pad.held, "it lets go")
    assert window.sent[-1] == ZERO


def test_x_s_repeats_of_a_key_that_types_another_letter_meanwhile_are_one_press(window, spin):
    send(window, QEvent.KeyPress, Qt.Key_E, E)
    send(window, QEvent.KeyRelease, EURO, E)
    send(window, QEvent.KeyPress, EURO, E)
    sent = len(window.sent)
    spin(lambda: len(window.sent) > sent + 2, "it goes on")
    assert window.pad.held == {"turn_right"} and ZERO not in window.sent


def test_altgr_alone_does_not_make_a_euro_sign_drive(window):
    send(window, QEvent.KeyPress, EURO, E)
    assert window.sent == []


@pytest.mark.parametrize(("letter", "code", "forward"), [(CYRILLIC_TSE, W, 1), (GREEK_SIGMA, S, -1)])
def test_a_keyboard_without_latin_letters_drives_by_the_places_of_its_keys(window, spin, letter, code, forward):
    send(window, QEvent.KeyPress, letter, code)
    assert window.sent == [(forward * USUAL_SPEED, 0.0, 0.0)]
    send(window, QEvent.KeyRelease, letter, code)
    spin(lambda: window.sent[-1] == ZERO, "it lets go")


@pytest.mark.parametrize("letter", [Qt.Key_Z, Qt.Key_Odiaeresis, Qt.Key_Escape, Qt.Key_Up, EURO])
def test_other_keys_are_what_they_say(qt, letter):
    assert command_key(key(QEvent.KeyPress, letter, W)) == letter


@pytest.mark.parametrize("widget", ["tabs", "choice"])
def test_arrows_choose_where_there_is_a_choice_and_drive_nowhere(window, widget):
    chosen = getattr(window, widget)
    chosen.setFocus()
    send(window, QEvent.KeyPress, Qt.Key_Right if widget == "tabs" else Qt.Key_Down, 116)
    assert chosen.currentIndex() == 1 and window.sent == []
    send(window, QEvent.KeyPress, Qt.Key_W, W)
    assert window.sent == [(USUAL_SPEED, 0.0, 0.0)], "letters drive there, too"


def test_the_space_bar_opens_a_choice_and_stops_everywhere_else(window, spin):
    window.tabs.setFocus()
    send(window, QEvent.KeyPress, Qt.Key_Space, 65)
    assert window.stops == [True]
    window.choice.setFocus()
    send(window, QEvent.KeyPress, Qt.Key_Space, 65)
    spin(lambda: window.choice.view().isVisible(), "the choice opens")
    assert window.stops == [True]
    window.choice.hidePopup()


def test_a_key_with_a_modifier_is_left_to_whom_it_is_for(window):
    window.choice.setFocus()
    event = key(QEvent.KeyPress, Qt.Key_W, W, Qt.ControlModifier)
    QApplication.sendEvent(window.choice, event)
    assert window.sent == [] and window.pad.held == set()
