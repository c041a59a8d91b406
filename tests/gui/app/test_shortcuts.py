"""Keys of the whole window."""

from types import SimpleNamespace

import pytest
from fake_window_parts import RUNNING, picture
from PyQt5.QtCore import QEvent, Qt
from PyQt5.QtGui import QKeyEvent
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication

from gui.app.shortcuts import COVERED, add_shortcuts

REPEATS = 20


@pytest.fixture
def window(open_window, link, terminal):
    window = open_window()
    tab = SimpleNamespace(window=window, link=link, terminal=terminal, controller=window.controller)
    window.page = add_shortcuts(window, [tab], lambda: tab)
    link.become(**RUNNING)
    link.picture.emit(picture())
    link.called.clear()
    return window


def hold(widget, key):
    """A key that is held: Qt marks all but the first of its presses."""
    for number in range(REPEATS):
        event = QKeyEvent(QEvent.KeyPress, key, Qt.NoModifier, "", number > 0)
        QApplication.sendEvent(widget.windowHandle(), event)


def test_a_held_esc_asks_once_to_stop(window, link):
    hold(window, Qt.Key_Escape)
    names = [name for name, *_ in link.called]
    assert (names.count("stop_drive"), link.asked.count("stop")) == (1, 1)


def test_page_up_goes_on_while_it_is_held(window):
    before = window.controller.controls.speed
    hold(window, Qt.Key_PageDown)
    assert window.controller.controls.speed < before - 0.05


def test_nothing_drives_behind_the_page_of_keys(window, link):
    window.controller.gamepad.receive([0.0] * 8, [0] * 11)
    QTest.keyClick(window, Qt.Key_F1)
    assert window.page.isVisible() and window.controller.driving.mux.block == COVERED
    window.controller.gamepad.receive([0.0, 1.0, *[0.0] * 6], [0, 0, 0, 0, 1, *[0] * 6])
    assert not any(map(any, link.driven)) and window.status.message == COVERED
    QTest.keyClick(window.focusWidget(), Qt.Key_W)
    assert not window.page.isVisible() and not any(map(any, link.driven))
    link.picture.emit(picture())
    QTest.keyPress(window, Qt.Key_W)
    assert link.driven and any(link.driven[-1]), window.status.message


def test_esc_stops_and_closes_the_page_of_keys(window, link):
    QTest.keyClick(window, Qt.Key_F1)
    QTest.keyClick(window.focusWidget(), Qt.Key_Escape)
    assert not window.page.isVisible() and link.asked == ["stop"]
