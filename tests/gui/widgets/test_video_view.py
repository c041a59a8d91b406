"""The camera picture on the screen."""

import math
import time

import numpy as np
import pytest

from gui.ros.picture import Picture
from gui.widgets.video_view import STALE_AFTER, VideoView


@pytest.fixture
def view(qt):
    view = VideoView()
    view.resize(400, 300)
    view.clear("Nothing yet", "Wait.")
    view.show()
    yield view
    view.close()


def picture(colour=(200, 100, 50), age=0.0, shape=(30, 40)):
    pixels = np.zeros((*shape, 3), np.uint8)
    pixels[:] = colour
    return Picture(pixels, "rgb8", stamp=time.time(), arrived=time.monotonic() - age)


def centre(view):
    colour = view.grab().toImage().pixelColor(view.width() // 2, view.height() // 2)
    return colour.red(), colour.green(), colour.blue()


def test_shows_the_newest_picture(view):
    view.show_picture(picture((250, 0, 0)))
    view.show_picture(picture((0, 0, 250)))
    assert centre(view) == (0, 0, 250)


def test_keeps_the_shape_of_the_picture(view):
    view.show_picture(picture((250, 0, 0), shape=(30, 30)))
    image = view.grab().toImage()
    assert image.pixelColor(20, 150).red() < 50
    assert image.pixelColor(60, 150).red() == 250


def test_an_old_picture_turns_grey_and_says_its_age(view, spin):
    changes = []
    view.stale_changed.connect(changes.append)
    view.show_picture(picture((250, 0, 0)))
    assert not view.stale
    view.show_picture(picture((250, 0, 0), age=STALE_AFTER + 0.5))
    spin(lambda: view.stale, "the view notices")
    assert changes == [True]
    corner = view.grab().toImage().pixelColor(5, 5)
    assert corner.red() == pytest.approx(corner.blue(), abs=12)
    assert view.age() > STALE_AFTER


def test_a_new_picture_brings_the_colour_back(view, spin):
    view.show_picture(picture(age=5.0))
    spin(lambda: view.stale, "the view notices")
    view.show_picture(picture((0, 250, 0)))
    assert not view.stale
    assert centre(view) == (0, 250, 0)


def test_tells_size_and_rate(view, spin):
    texts = []
    view.status.connect(texts.append)
    now = time.monotonic()
    for index in range(11):
        view.show_picture(Picture(picture().pixels, "rgb8", 0.0, now - 1.0 + 0.1 * index))
    spin(lambda: texts, "the status is told")
    assert texts[-1] == "40 × 30   10 pictures/s"


def test_one_picture_tells_no_rate(view, spin):
    texts = []
    view.status.connect(texts.append)
    view.show_picture(picture())
    spin(lambda: texts, "the status is told")
    assert texts[-1] == "40 × 30" and math.isnan(view.rate())


def test_the_first_picture_after_clearing_is_announced_once(view, spin):
    announced = []
    view.first_picture.connect(lambda: announced.append(True))
    for _ in range(3):
        view.show_picture(picture())
        view.grab()
    spin(lambda: announced, "the first picture is announced")
    view.clear("Off", "Press the button.")
    view.show_picture(picture())
    view.grab()
    spin(lambda: len(announced) == 2, "the first after clearing is announced")


def test_without_a_picture_it_is_neither_stale_nor_young(view):
    assert view.age() == float("inf") and not view.stale and view.rate() == 0.0


def test_paints_in_a_window_without_height(view):
    view.show_picture(picture())
    view.resize(300, 1)
    view.grab()
