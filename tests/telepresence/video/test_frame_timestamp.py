"""A picture's own time, through noise, compression and half size."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from telepresence.video.frame_timestamp import draw_time, read_age, strip_height

NOW = 1_795_300_000.1234


def picture(width=640, height=480):
    return np.random.default_rng(1).integers(0, 255, (height, width, 3), dtype=np.uint8)


@pytest.mark.parametrize("size", [(160, 120), (320, 240), (640, 480), (800, 600), (1280, 720)])
def test_age_is_read_back_at_every_size(size):
    pixels = picture(*size)
    draw_time(pixels, NOW)
    assert read_age(pixels, NOW + 0.25) == pytest.approx(0.25, abs=2e-4)


def test_survives_compression_that_ruins_details():
    pixels = picture()
    draw_time(pixels, NOW)
    _, data = cv2.imencode(".jpg", pixels, (cv2.IMWRITE_JPEG_QUALITY, 10))
    assert read_age(cv2.imdecode(data, cv2.IMREAD_COLOR), NOW) == pytest.approx(0.0, abs=2e-4)


def test_a_clock_that_is_behind_gives_a_negative_age():
    pixels = picture()
    draw_time(pixels, NOW)
    assert read_age(pixels, NOW - 0.5) == pytest.approx(-0.5, abs=2e-4)


@pytest.mark.parametrize("value", [0, 255])
def test_a_plain_strip_is_no_time(value):
    pixels = np.full((480, 640, 3), value, np.uint8)
    assert read_age(pixels, NOW) is None


def test_almost_every_other_picture_is_no_time():
    rng = np.random.default_rng(0)
    read = [read_age(rng.integers(0, 2, (24, 80), dtype=np.uint8) * 255, NOW) for _ in range(300)]
    assert sum(age is not None for age in read) < 10, "eight bits of check let one in 256 pass"


def test_a_damaged_block_is_noticed():
    for block in range(40):
        pixels = picture()
        draw_time(pixels, NOW)
        top = 480 - strip_height(640) + (block // 20) * strip_height(640) // 2
        left = block % 20 * 32
        pixels[top : top + strip_height(640) // 2, left : left + 32] ^= 0xFF
        assert read_age(pixels, NOW) is None


def test_too_small_a_picture_is_refused():
    with pytest.raises(ValueError, match="80 x 8"):
        draw_time(np.zeros((4, 40), np.uint8), NOW)
    assert read_age(np.zeros((4, 40), np.uint8), NOW) is None
