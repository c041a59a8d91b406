"""What a screen reader says: each button's name, who has stopped the robot, and the whole message at the bottom."""

from fake_window_parts import RUNNING
from PyQt5.QtWidgets import QAbstractButton

from gui.app.controller import Attach


def name_of(widget):
    """As a screen reader takes it: the accessible name, else the text."""
    return widget.accessibleName() or widget.text().replace("&", "")


def test_every_button_has_a_name_of_words(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    own = [button for button in window.findChildren(QAbstractButton) if not button.objectName().startswith("qt_")]
    assert {button.objectName() for button in own} >= {"themeButton", "foldButton", "redStop", "pad_turn_left"}
    unnamed = [button.objectName() for button in own if len([one for one in name_of(button) if one.isalpha()]) < 2]
    assert unnamed == []


def test_the_red_stop_says_who_has_stopped_the_robot(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    red = window.controller.controls.redStop
    assert name_of(red) == "Red stop"
    link.report_lease(stopped_by="anna")
    assert name_of(red) == "Red stop: STOPPED by anna. Press to reset"
    link.report_lease(stopped_by="")
    assert name_of(red) == "Red stop"


def test_a_message_that_does_not_fit_is_read_to_its_end(open_window):
    window = open_window(Attach.NEVER)
    text = "The robot's programs are not running. " * 20
    window.status.say(text, "warn")
    assert window.status._message.text().endswith("…") and name_of(window.status._message) == text
