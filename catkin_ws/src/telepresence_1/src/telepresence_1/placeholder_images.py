"""Pictures for when there is no picture: a test card, and a notice that says in words what is missing.

Everything that matters lies in the middle 5/6 of the height, because the tablet's page crops 4:3 to its 16:10.
"""

from __future__ import annotations

import functools
import itertools
import math
import time

import cv2
import numpy as np

from telepresence.video.draw_text import text_width, write

_INK = (44, 34, 26)  # BGR, as everything here
_PAPER = (250, 246, 240)
_MUTED = (190, 172, 150)
_AMBER = (74, 178, 255)
_BARS = ((200, 200, 200), (60, 196, 222), (196, 188, 64), (96, 180, 72), (178, 84, 176), (72, 72, 214), (190, 92, 48))
_SHIFT = 3  # fractional bits of coordinates for cv2: 1/8 pixel


def draw_test_card(width: int, height: int, now: float) -> np.ndarray:
    """A test card with a clock whose hand sweeps: a frozen picture is seen at once.

    Args:
        now: The time it shows [s since 1970].
    Returns:
        (height, width, 3) uint8 BGR.
    """
    card = _test_card_of_a_second(width, height, time.strftime("%H:%M:%S", time.localtime(now))).copy()
    unit = height / 480
    centre, radius = (width / 2, height / 2), 128 * unit
    angle = (now % 60.0) / 60.0 * 2 * math.pi
    tip = (centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle))
    sweep = (now % 60.0) * 6.0
    _arc(card, centre, radius, sweep, _AMBER, round(5 * unit))
    cv2.circle(card, _fixed(tip), round(9 * unit * 2**_SHIFT), _PAPER, -1, cv2.LINE_AA, _SHIFT)
    tenth = int(now * 10) % 10
    for index in range(10):
        lit = _AMBER if index <= tenth else (92, 76, 62)
        place = (centre[0] + (index - 4.5) * 14 * unit, centre[1] + 62 * unit)
        cv2.circle(card, _fixed(place), round(3.5 * unit * 2**_SHIFT), lit, -1, cv2.LINE_AA, _SHIFT)
    return card


@functools.lru_cache(maxsize=1)
def _test_card_of_a_second(width: int, height: int, clock: str) -> np.ndarray:
    """Return the test card with all that is written on it: the letters are most of the work."""
    card = _test_card_ground(width, height).copy()
    unit = height / 480
    _write_clock(card, clock, width / 2, height / 2 - 34 * unit, 27 * unit)
    write(card, "test picture", round(width / 2), round(height / 2 + 22 * unit), 15 * unit, _MUTED, align=0.5)
    return card


def draw_notice(width: int, height: int, title: str, text: str, now: float, missing: bool = True) -> np.ndarray:
    """A picture that says what is wrong, (height, width, 3) uint8 BGR, with the time `now` [s since 1970].

    The camera on it is crossed out if `missing`."""
    card = _notice_ground(width, height, missing).copy()
    unit = height / 480
    middle = width // 2
    column = round(min(width * 0.84, 560 * unit))
    left = middle - column // 2
    top = write(card, title, left, round(196 * unit), 30 * unit, _PAPER, weight=1.5, width=column, align=0.5)
    top = write(card, text, left, round(top + 10 * unit), 15 * unit, (214, 202, 188), width=column, align=0.5)
    clock = time.strftime("%H:%M:%S", time.localtime(now))
    write(card, clock, middle, round(top + 14 * unit), 15 * unit, _AMBER, weight=1.2, align=0.5)
    return card


@functools.lru_cache(maxsize=4)
def _test_card_ground(width: int, height: int) -> np.ndarray:
    unit = height / 480
    card = np.empty((height, width, 3), np.uint8)
    card[:] = (62, 50, 40)
    step = 40 * unit
    for k in range(-20, 21):  # a grid from the middle: squares that are not square show a wrong aspect ratio
        x, y = round(width / 2 + k * step), round(height / 2 + k * step)
        if 0 <= x < width:
            card[:, x] = (84, 70, 58)
        if 0 <= y < height:
            card[y, :] = (84, 70, 58)
    # Bars at the side edges, tall enough to survive the cropping of any screen.
    bar = round(60 * unit)
    edges = np.linspace(0, height, len(_BARS) + 1).round().astype(int)
    for (y0, y1), colour in zip(itertools.pairwise(edges), _BARS, strict=True):
        card[y0:y1, :bar] = colour
        card[y0:y1, width - bar :] = colour[::-1]
    grey = np.linspace(16, 235, 11).round().astype(np.uint8)
    blocks = np.repeat(grey, math.ceil((width - 2 * bar) / 11))[: width - 2 * bar]
    for y0 in (round(52 * unit), round(height - 82 * unit)):
        card[y0 : y0 + round(30 * unit), bar : width - bar] = blocks[None, :, None]
        blocks = blocks[::-1]
    centre = (width / 2, height / 2)
    cv2.circle(card, _fixed(centre), round(150 * unit * 2**_SHIFT), (30, 24, 18), -1, cv2.LINE_AA, _SHIFT)
    _arc(card, centre, 128 * unit, 360.0, (92, 76, 62), round(5 * unit))
    for minute in range(0, 60, 5):
        turn = math.radians(minute * 6)
        inner, outer = 106 * unit, 116 * unit
        ends = [(centre[0] + r * math.sin(turn), centre[1] - r * math.cos(turn)) for r in (inner, outer)]
        cv2.line(card, _fixed(ends[0]), _fixed(ends[1]), _MUTED, max(1, round(2 * unit)), cv2.LINE_AA, _SHIFT)
    return card


@functools.lru_cache(maxsize=4)
def _notice_ground(width: int, height: int, missing: bool) -> np.ndarray:
    """A dark ground that is lighter in the middle, and a camera."""
    unit = height / 480
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    distance = np.hypot((x - width / 2) / width, (y - height * 0.4) / height)
    light = np.clip(1.0 - distance * 1.25, 0.25, 1.0)[:, :, None]
    # Noise below the last bit, else the gradient shows steps.
    noise = np.random.default_rng(0).uniform(-0.5, 0.5, (height, width, 1))
    card = np.clip(np.array((78, 62, 48)) * light + noise, 0, 255).astype(np.uint8)
    cx, cy = width / 2, 122 * unit
    size = round(120 * unit)
    fine = 4
    s = size * fine / 120
    body, slash = np.zeros((2, size * fine, size * fine), np.uint8)
    thick = round(6 * s)

    def at(px: float, py: float) -> tuple[int, int]:
        return round(px * s), round(py * s)

    cv2.rectangle(body, at(14, 36), at(78, 88), 255, thick, cv2.LINE_AA)
    lens = np.array([at(78, 56), at(106, 42), at(106, 82), at(78, 68)], np.int32)
    cv2.polylines(body, [lens], True, 255, thick, cv2.LINE_AA)
    if missing:
        cv2.line(body, at(16, 108), at(104, 16), 0, thick * 3, cv2.LINE_AA)
        cv2.line(slash, at(16, 108), at(104, 16), 255, thick, cv2.LINE_AA)
    left, top = round(cx - size / 2), round(cy - size / 2)
    area = card[top : top + size, left : left + size]
    for mask, colour in ((body, _PAPER), (slash, _AMBER)):
        alpha = cv2.resize(mask, (size, size), interpolation=cv2.INTER_AREA)[:, :, None] / 255.0
        area[:] = (area * (1 - alpha) + np.array(colour) * alpha).astype(np.uint8)
    return card


def _write_clock(card: np.ndarray, clock: str, middle: float, top: float, size: float) -> None:
    """Each digit in the middle of a cell as wide as an 8, so that the clock does not jitter."""
    cell = text_width("8", size, 1.2) + size * 0.12
    cells = [cell * 0.55 if sign == ":" else cell for sign in clock]
    left = middle - sum(cells) / 2
    for sign, width in zip(clock, cells, strict=True):
        write(card, sign, round(left + width / 2), round(top), size, _PAPER, weight=1.2, align=0.5)
        left += width


def _arc(
    card: np.ndarray,
    centre: tuple[float, float],
    radius: float,
    degrees: float,
    colour: tuple[int, int, int],
    thick: int,
) -> None:
    """A circle's beginning, clockwise from the top."""
    turns = np.radians(np.linspace(0.0, degrees, max(2, round(degrees / 2))))
    points = np.stack([centre[0] + radius * np.sin(turns), centre[1] - radius * np.cos(turns)], axis=1)
    fixed = (points * 2**_SHIFT).round().astype(np.int32)
    cv2.polylines(card, [fixed], False, colour, max(1, thick), cv2.LINE_AA, _SHIFT)


def _fixed(point: tuple[float, float]) -> tuple[int, int]:
    return round(point[0] * 2**_SHIFT), round(point[1] * 2**_SHIFT)
