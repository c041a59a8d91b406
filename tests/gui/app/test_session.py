"""For which robot the programs run that the buttons connect with."""

from fake_window_parts import RUNNING
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest

from gui.app.controller import Attach


def test_an_address_that_running_programs_do_not_use_is_said_and_how_to_use_it(open_window, terminal, link):
    """Else the keys would drive one robot while the header shows another one's address."""
    window = open_window()
    window.address.setText("127.0.0.1")
    link.become(master=True, joined=True)
    QTest.mouseClick(window.sessionButton, Qt.LeftButton)
    terminal.running = "roslaunch"
    link.become(**RUNNING)
    assert "Connected to Pepper" in window.status.message
    window.address.setText("127.0.0.2")
    link.become(master=True, joined=True)
    link.become(**RUNNING)  # the driver has started anew, for the same robot
    for button in (window.sessionButton, window.roscoreButton):
        QTest.mouseClick(button, Qt.LeftButton)
        message = window.status.message
        assert "for 127.0.0.1." in message and "127.0.0.2 is not used" in message and "Stop, then Roscore" in message
        assert window.address.property("invalid") and len(terminal.lines) == 1

    QTest.mouseClick(window.stopButton, Qt.LeftButton)
    terminal.running = ""
    terminal.ended.emit("")
    link.become(master=True, joined=True)
    assert not window.address.property("invalid")
    QTest.mouseClick(window.roscoreButton, Qt.LeftButton)
    assert "nao_ip:=127.0.0.2" in terminal.lines[-1][1]
    link.become(**RUNNING)
    QTest.mouseClick(window.sessionButton, Qt.LeftButton)
    assert "Connected to Pepper" in window.status.message


def test_the_address_for_which_programs_were_found_is_taken_for_theirs(open_window, terminal, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    window.address.setText("127.0.0.2")
    QTest.mouseClick(window.sessionButton, Qt.LeftButton)
    assert "for 192.168.1.10." in window.status.message and terminal.lines == []
    window.address.setText("192.168.1.10")
    assert not window.address.property("invalid")
    QTest.mouseClick(window.sessionButton, Qt.LeftButton)
    assert "Connected to Pepper" in window.status.message
