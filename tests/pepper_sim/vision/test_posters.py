"""Posters as they are written on the command line, and landmarks as they are drawn and read."""

import math

import cv2
import numpy as np
import pytest

from pepper_sim.naoqi.vision import landmarks
from pepper_sim.posters import parse_poster


def test_a_poster_is_written_as_what_and_where():
    poster = parse_poster("code:a@b@1.5,-0.4,1.2,90,0.3")
    assert (poster.ahead, poster.left, poster.height, poster.width) == (1.5, -0.4, 1.2, 0.3)
    assert poster.turn == pytest.approx(math.pi / 2)
    assert cv2.QRCodeDetector().detectAndDecode(poster.pixels)[0] == "a@b"
    assert parse_poster("mark:85@1,0,1").width == 0.2


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("mark:85", "WHAT@AHEAD,LEFT,HEIGHT"),
        ("mark:85@1,2", "WHAT@AHEAD,LEFT,HEIGHT"),
        ("mark:85@1,2,nan", "WHAT@AHEAD,LEFT,HEIGHT"),
        ("mark:85@1,2,3,4,5,6", "WHAT@AHEAD,LEFT,HEIGHT"),
        ("mark:house@1,2,3", "a landmark has a number"),
        ("mark:256@1,2,3", "numbered from 0 to 255"),
        ("nothing.png@1,2,3", "cannot be read"),
        ("mark:85@1,2,3,0,0", "between 0.01 and 10 m wide"),
    ],
)
def test_what_is_no_poster_is_refused(text, says):
    with pytest.raises(ValueError) as caught:
        parse_poster(text)
    assert says in str(caught.value)


def test_no_mark_looks_like_another_one_that_hangs_askew():
    codes = landmarks.codes()
    assert len(set(codes)) == landmarks.NUMBERS == 256
    turned = {code: {landmarks._rotated(code, turn) for turn in range(landmarks.SECTORS)} for code in codes}
    assert all(len(rotations) == landmarks.SECTORS for rotations in turned.values())
    assert len(set().union(*turned.values())) == landmarks.SECTORS * len(codes)


@pytest.mark.parametrize("number", [0, 68, 85, 130, 255])
@pytest.mark.parametrize(("diameter", "turn"), [(24, 17.0), (45, 200.0), (160, 73.0)])
def test_a_mark_is_read_at_any_angle_and_size(number, diameter, turn):
    scene = _seen(landmarks.draw(number)[:, :, 0], diameter, turn)
    (mark,) = landmarks.find(scene, 14, 300)
    assert mark.number == number
    assert (mark.x, mark.y) == pytest.approx((160, 120), abs=1.0)
    assert (mark.width, mark.height) == pytest.approx((diameter, diameter), rel=0.1)
    assert landmarks.find(scene, 14, diameter - 8) == [], "it is larger than what is looked for"


def test_a_mark_that_is_turned_away_is_read_up_to_45_degrees():
    for degrees in (30, 45):
        narrow = math.cos(math.radians(degrees))
        mark = landmarks.draw(85)[:, :, 0]
        squeezed = cv2.resize(mark, (round(256 * narrow), 256), interpolation=cv2.INTER_AREA)
        (found,) = landmarks.find(_seen(squeezed, 80, 0.0), 14, 300)
        assert found.number == 85 and found.tilt == pytest.approx(math.radians(degrees), abs=0.1)


def test_what_is_no_mark_is_not_read():
    scene = np.full((240, 320), 200, np.uint8)
    cv2.circle(scene, (100, 120), 30, 10, -1)
    cv2.rectangle(scene, (180, 90), (240, 150), 10, -1)
    assert landmarks.find(scene, 14, 300) == []


def _seen(mark, diameter, turn):
    """A mark in the middle of a picture with blur and noise, (240, 320) uint8."""
    height, width = mark.shape
    matrix = cv2.getRotationMatrix2D((width / 2, height / 2), turn, diameter / (landmarks.DISC * 256))
    matrix[:, 2] += (160 - width / 2, 120 - height / 2)
    scene = cv2.warpAffine(mark, matrix, (320, 240), flags=cv2.INTER_AREA, borderValue=230)
    noise = np.random.default_rng(1).normal(0.0, 2.0, scene.shape)
    return np.clip(cv2.GaussianBlur(scene, (3, 3), 0.6) * 0.7 + 20 + noise, 0, 255).astype(np.uint8)
