"""Landmarks: black discs with white fans around the centre, drawn for posters and read from pictures.

The look is that of NAO's marks (NAOqi 2.8 documentation, allandmarkdetection); which fans stand for which number is not
published, so the code is our own: twelve sectors of 30 degrees, white or black. A number stands for a sequence that
differs from each of its own rotations, so the disc may hang at any angle. Printed marks of a real robot are not read.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import cv2
import numpy as np

SECTORS = 12
NUMBERS = 256
"""Marks are numbered from 0 to this, exclusive."""
DISC = 0.8
"""Diameter of the disc, as a part of the poster's width."""

_FANS = (0.3, 0.82)  # inner and outer radius of the white fans, as parts of the disc's
_READ_AT = (0.45, 0.57, 0.69)  # radii at which they are read
_SAMPLES = 10  # per sector
_LEAST_RATIO = math.cos(math.radians(50.0))  # shape of a disc that is turned away; 45 degrees are promised
_LEAST_CONTRAST = 40.0
_LEAST_AGREEMENT = 0.8


@dataclass(frozen=True)
class FoundMark:
    """A mark in a picture.

    Args:
        number: What it stands for.
        x, y: Its centre [px].
        width, height: Its extent [px].
        tilt: How far it is turned away from the camera about the vertical axis, 0 or more [rad].
    """

    number: int
    x: float
    y: float
    width: float
    height: float
    tilt: float


@functools.cache
def codes() -> tuple[int, ...]:
    """Return the sequence of each number as bits, the smallest of its rotations; few changes of colour come first."""
    found = [
        code
        for code in range(1 << SECTORS)
        if 3 <= code.bit_count() <= SECTORS - 3 and all(code < _rotated(code, turn) for turn in range(1, SECTORS))
    ]
    found.sort(key=lambda code: ((code ^ _rotated(code, 1)).bit_count(), code))
    return tuple(found[:NUMBERS])


def draw(number: int, size: int = 256) -> np.ndarray:
    """Return a poster with a mark: (size, size, 3) uint8.

    Raises: ValueError: There is no mark of this number.
    """
    if not 0 <= number < NUMBERS:
        raise ValueError(f"there is no landmark {number}; they are numbered from 0 to {NUMBERS - 1}")
    picture = np.full((size, size, 3), 255, np.uint8)
    radius, middle = DISC * size / 2.0, (size // 2, size // 2)
    cv2.circle(picture, middle, round(radius), (0, 0, 0), -1, cv2.LINE_AA)
    code = codes()[number]
    outer = round(radius * _FANS[1])
    for sector in range(SECTORS):
        if code >> sector & 1:
            begin = 360.0 / SECTORS * sector
            end = begin + 360.0 / SECTORS
            cv2.ellipse(picture, middle, (outer, outer), 0.0, begin, end, (255, 255, 255), -1, cv2.LINE_AA)
    cv2.circle(picture, middle, round(radius * _FANS[0]), (0, 0, 0), -1, cv2.LINE_AA)
    return picture


def find(grey: np.ndarray, least: float, most: float) -> list[FoundMark]:
    """Return the marks in a picture, those farthest left first.

    Args:
        grey: (height, width) uint8.
        least, most: Smallest and largest diameter [px].
    """
    dark = cv2.adaptiveThreshold(grey, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, 61, 12)
    contours, _ = cv2.findContours(dark, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    marks: list[FoundMark] = []
    for contour in contours:
        if len(contour) < 5 or not 0.5 * least * least * _LEAST_RATIO < cv2.contourArea(contour) < most * most:
            continue
        mark = _read(grey, contour, least, most)
        if mark is not None and all(math.hypot(mark.x - old.x, mark.y - old.y) > least / 2 for old in marks):
            marks.append(mark)
    return sorted(marks, key=lambda mark: mark.x)


def _read(grey: np.ndarray, contour: np.ndarray, least: float, most: float) -> FoundMark | None:
    (x, y), (first, second), degrees = cv2.fitEllipse(contour)
    if not (least <= max(first, second) <= most and min(first, second) >= _LEAST_RATIO * max(first, second)):
        return None
    if not 0.93 < cv2.contourArea(contour) / (math.pi / 4.0 * first * second) < 1.07:
        return None
    # A tilted disc is drawn shorter along one direction; undo that, and the sectors have equal angles again.
    turn = np.array(_rotation(math.radians(degrees)))
    shape = turn @ np.diag((first / 2.0, second / 2.0)) @ turn.T
    number = _decode(grey, np.array((x, y)), shape)
    if number is None:
        return None
    width, height = (float(2.0 * np.linalg.norm(shape[axis])) for axis in (0, 1))
    return FoundMark(number, float(x), float(y), width, height, math.acos(min(1.0, width / height)))


def _decode(grey: np.ndarray, centre: np.ndarray, shape: np.ndarray) -> int | None:
    angles = 2.0 * np.pi * (np.arange(SECTORS * _SAMPLES) + 0.5) / (SECTORS * _SAMPLES)
    ring = shape @ np.stack([np.cos(angles), np.sin(angles)])
    places = (centre[:, None, None] + ring[:, None, :] * np.array(_READ_AT)[None, :, None]).astype(np.float32)
    seen = cv2.remap(grey, places[0], places[1], cv2.INTER_LINEAR).mean(axis=0)
    if float(np.ptp(seen)) < _LEAST_CONTRAST:
        return None
    white = seen > (float(seen.min()) + float(seen.max())) / 2.0
    best, bits = 0.0, np.zeros(SECTORS)
    for shift in range(_SAMPLES):
        shares = np.roll(white, -shift).reshape(SECTORS, _SAMPLES).mean(axis=1)
        agreement = float(np.abs(2.0 * shares - 1.0).mean())
        if agreement > best:
            best, bits = agreement, shares > 0.5
    if best < _LEAST_AGREEMENT:
        return None
    code = sum(1 << sector for sector in range(SECTORS) if bits[sector])
    smallest = min(_rotated(code, turn) for turn in range(SECTORS))
    return codes().index(smallest) if smallest in codes() else None


def _rotated(code: int, turn: int) -> int:
    return (code >> turn | code << (SECTORS - turn)) & ((1 << SECTORS) - 1)


def _rotation(angle: float) -> tuple[tuple[float, float], tuple[float, float]]:
    return (math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))
