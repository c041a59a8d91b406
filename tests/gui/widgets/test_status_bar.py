"""The line at the bottom."""

import pytest

from gui.widgets.status_bar import StatusBar


@pytest.fixture
def bar(qt):
    bar = StatusBar()
    bar.resize(900, 34)
    bar.show()
    yield bar
    bar.close()


def test_a_long_message_is_cut_but_kept(bar):
    text = "The robot's programs are not running. " * 20
    bar.say(text, "warn")
    label = bar.findChild(type(bar._message), "message")
    assert bar.message == text == label.toolTip()
    assert label.text().endswith("…") and len(label.text()) < len(text)
    assert bar.width() == 900


def test_chips_show_text_and_level(bar):
    bar.set_chip("master", "ROS master", "good", "http://127.0.0.1:11311")
    assert bar.chip("master") == ("ROS master", "good")
    bar.set_chip("master", "No ROS master", "bad")
    assert bar.chip("master") == ("No ROS master", "bad")
