"""Nothing drives by pictures that are late, however late they are, nor by one that comes again and again."""

import dataclasses
import time

import pytest
from fake_window_parts import RUNNING, picture
from PyQt5.QtTest import QTest

from gui.app.controller import Attach
from gui.app.views import OTHER_CLOCK

PERIOD = 50  # ms


@pytest.fixture
def window(open_window, link):
    window = open_window(Attach.NEVER)
    link.become(**RUNNING)
    window.feedButton.setChecked(True)
    return window


@pytest.fixture
def shows(window, link):
    """Show pictures for some seconds that are so old, or were taken at the given time; return what forbade driving."""

    def show(seconds, old=0.1, taken=None):
        blocks, end = [], time.monotonic() + seconds
        while time.monotonic() < end:
            stamp = time.time() - old if taken is None else taken
            link.picture.emit(dataclasses.replace(picture(), stamp=stamp))
            QTest.qWait(PERIOD)
            blocks.append(window.controller.driving.mux.block)
        return blocks

    return show


@pytest.mark.parametrize("old", [4.9, 30.0])
def test_no_picture_is_too_late_to_be_late(shows, old):
    assert shows(0.5)[-1] == ""
    assert "late" in shows(1.0, old=old)[-1]
    assert all(shows(2.5, old=old)), "and so it stays"
    assert shows(1.0)[-1] == ""


@pytest.mark.parametrize("old", [0.1, 6.0])
def test_a_picture_that_comes_again_and_again_is_lost(window, shows, old):
    """What it shows was so 0.1 s ago, or as long ago as differing clocks were once taken for."""
    assert shows(0.5)[-1] == ""
    taken = time.time() - old
    shows(1.5, taken=taken)
    assert window.video.stale and window.status.chip("picture") == ("Picture lost", "bad")
    assert all(shows(1.5, taken=taken)), "and so it stays"
    assert shows(1.0)[-1] == "" and not window.video.stale


def test_pictures_without_a_time_are_not_one_that_comes_again(window, shows):
    assert set(shows(1.5, taken=0.0)) == {""} and not window.video.stale


def test_that_clocks_differ_is_said_once(window, shows):
    said = []
    window.status.said.connect(lambda text, _level: said.append(text))
    assert set(shows(1.5, old=30.0)) == {""}
    assert said.count(OTHER_CLOCK) == 1 and window.health.gauge("age") == ("–", "off")
    shows(0.5, old=30.0)
    assert said.count(OTHER_CLOCK) == 1
