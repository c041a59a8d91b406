"""Windows that are joined to a robot and a terminal that only note what was asked of them."""

import pytest

from gui.app.controller import Attach, Controller
from gui.window import OperatorWindow
from telepresence.teleop.lease_messages import PILOT, Account


@pytest.fixture
def open_window(qt, link, terminal, spin):
    opened = []

    def open_one(attach=Attach.AUTO, role=PILOT, begins_conversation=False):
        window = OperatorWindow(terminal)
        window.address.setText("192.168.1.10")
        window.controller = Controller(window, link, terminal, attach)
        window.controller.begins_conversation = begins_conversation
        window.controller.admit(Account("anna", role))
        window.show_on_screen()
        opened.append(window)
        spin(window.isActiveWindow, "the window is active")
        return window

    yield open_one
    for window in opened:
        window.close()
        window.deleteLater()
