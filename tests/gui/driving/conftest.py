"""A small window around a drive pad."""

import pytest
from PyQt5.QtWidgets import QVBoxLayout, QWidget

from gui.driving.drive_pad import DrivePad


@pytest.fixture
def make_pad_window(qt, spin):
    """Make an active window of a drive pad and what else it holds, by attribute; what the pad sends is in `sent`."""
    made = []

    def make(**others):
        window = QWidget()
        layout = QVBoxLayout(window)
        window.pad, window.sent = DrivePad(), []
        for name, widget in {"pad": window.pad, **others}.items():
            setattr(window, name, widget)
            layout.addWidget(widget)
        window.pad.velocity.connect(lambda *velocity: window.sent.append(velocity))
        made.append(window)
        window.show()
        window.activateWindow()
        window.setFocus()
        spin(window.isActiveWindow, "the window is active")
        return window

    yield make
    for window in made:
        window.close()
        window.deleteLater()
