"""The page of keys lists what the keys do on this robot, in the way that was chosen."""

from __future__ import annotations

import pytest
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QLabel, QLineEdit, QPushButton, QWidget

from gui.driving.help_overlay import HelpOverlay, sections


@pytest.fixture
def page(qt, spin):
    window = QWidget()
    window.resize(1000, 600)
    chosen = {"by_movement": False, "guide_keys": False}
    overlay = HelpOverlay(window, lambda: (sections(**chosen), not chosen["by_movement"]))
    overlay.chosen = chosen
    window.show()
    yield overlay
    window.close()


def listed(page) -> set[str]:
    """The keys on the opened page."""
    page.open()
    return {label.text() for label in page.findChildren(QLabel) if label.isVisible()}


def test_it_lists_how_q_and_e_turn_now(page):
    assert "Q  E   ←  →" in listed(page)
    page.shut()
    page.chosen["guide_keys"] = True
    assert "Q  E" in listed(page) and "Q  E   ←  →" not in listed(page)
    QTest.keyClick(page, Qt.Key_Space)
    assert not page.isVisible()


def test_the_walker_has_keys_of_its_own(page):
    page.chosen["by_movement"] = True
    keys = listed(page)
    assert "W  S   ↑  ↓" in keys and "button 0" in keys
    assert "A  D" not in keys and "LB" not in keys and not any("<b>" in cap for cap in keys)


def test_tab_closes_it_as_any_key_does_and_reaches_nothing_beneath(page, spin):
    window = page.parentWidget()
    field, beneath = QLineEdit(window), QPushButton(window)
    for widget in (field, beneath):
        widget.show()
    window.activateWindow()
    field.setFocus()
    spin(field.hasFocus, "somebody types")
    shown = []
    page.shown.connect(shown.append)
    page.open()
    QTest.keyClick(page, Qt.Key_Tab)
    assert not page.isVisible() and field.hasFocus() and shown == [True, False]
