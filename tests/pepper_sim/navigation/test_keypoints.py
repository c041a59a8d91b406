"""Turns between two pictures, by what both show."""

import math

import cv2
import numpy as np
import pytest

from pepper_sim.navigation.keypoints import deviation, find_keypoints

FOCAL = 300.0
WIDTH, HEIGHT = 320, 240


@pytest.fixture(scope="module", name="wall")
def _wall():
    """A wall full of rectangles, larger than a picture of it."""
    rng = np.random.default_rng(1)
    wall = np.full((400, 800, 3), 128, np.uint8)
    for _ in range(250):
        x, y, w, h = rng.integers((0, 0, 8, 8), (790, 390, 60, 60)).tolist()
        cv2.rectangle(wall, (x, y), (x + w, y + h), rng.integers(0, 255, 3).tolist(), -1)
    return wall


def test_a_turn_is_measured(wall):
    before = find_keypoints(wall[80 : 80 + HEIGHT, 200 : 200 + WIDTH], FOCAL)
    # The camera looks 40 px farther to the left and 12 px farther up.
    after = find_keypoints(wall[68 : 68 + HEIGHT, 160 : 160 + WIDTH], FOCAL)
    found = deviation(before, after)
    assert found.sure and found.share > 0.7 and len(found.matches) > 30
    assert found.left == pytest.approx(math.atan(40 / FOCAL), abs=0.02)
    assert found.up == pytest.approx(math.atan(12 / FOCAL), abs=0.02)


def test_pictures_that_share_nothing_say_nothing(wall):
    before = find_keypoints(wall[80 : 80 + HEIGHT, 0:WIDTH], FOCAL)
    assert not deviation(before, find_keypoints(wall[80 : 80 + HEIGHT, 480:800], FOCAL)).sure
    blank = find_keypoints(np.full((HEIGHT, WIDTH, 3), 200, np.uint8), FOCAL)
    assert deviation(before, blank).matches == ()
