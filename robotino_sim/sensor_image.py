"""The drawing at /sensorimage: Robotino from above, its infrared readings, and whether its bumper is pressed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from robotino_sim.infrared import COUNT, MOUNTING_RADIUS, NOTHING

SIZE = 320
"""Width and height [px]."""
_PIXELS_PER_METRE = 0.46 * SIZE / (MOUNTING_RADIUS + NOTHING)
_BACKGROUND, _BODY, _EDGE = (250, 248, 246), (205, 200, 196), (90, 86, 82)
_PRESSED, _FREE, _FRONT = (60, 60, 220), (150, 175, 90), (190, 120, 20)
_SHIFT = 4  # OpenCV's fixed point: positions in sixteenths of a pixel


def draw_sensors(distances: Sequence[float], bumper: bool) -> bytes:
    """Return a PNG; ahead is up.

    Args:
        distances: Nine readings [m], 0 ahead, counter-clockwise.
        bumper: Pressed or not.
    """
    picture = np.full((SIZE, SIZE, 3), _BACKGROUND, np.uint8)
    for i, distance in enumerate(distances):
        near = max(0.0, min(1.0, 1.0 - distance / NOTHING))
        colour = tuple(round(f + near * (p - f)) for f, p in zip(_FREE, _PRESSED, strict=True))
        heading = math.tau * i / COUNT
        reach = [_at(MOUNTING_RADIUS + distance, heading + turn) for turn in (-0.08, -0.04, 0.0, 0.04, 0.08)]
        beam = np.array([_at(MOUNTING_RADIUS, heading), *reach])
        cv2.fillPoly(picture, [beam], colour, cv2.LINE_AA, _SHIFT)
        if distance < NOTHING:
            x, y = (int(v) >> _SHIFT for v in _at(MOUNTING_RADIUS * 0.72, heading))
            label = f"{100 * distance:.0f}"
            cv2.putText(picture, label, (x - 8, y + 4), cv2.FONT_HERSHEY_SIMPLEX, 0.4, _EDGE, 1, cv2.LINE_AA)
    centre = (SIZE // 2, SIZE // 2)
    radius = round(MOUNTING_RADIUS * _PIXELS_PER_METRE)
    disc = picture.copy()
    cv2.circle(disc, centre, radius, _BODY, -1, cv2.LINE_AA)
    cv2.addWeighted(disc, 0.6, picture, 0.4, 0.0, picture)
    cv2.circle(picture, centre, radius, _PRESSED if bumper else _EDGE, 7 if bumper else 2, cv2.LINE_AA)
    cv2.arrowedLine(picture, centre, (centre[0], centre[1] - radius // 2), _FRONT, 3, cv2.LINE_AA, 0, 0.35)
    done, data = cv2.imencode(".png", picture, (cv2.IMWRITE_PNG_COMPRESSION, 1))
    if not done:
        raise RuntimeError("OpenCV could not encode the drawing as PNG")
    return data.tobytes()


def _at(radius: float, heading: float) -> tuple[int, int]:
    x = SIZE / 2 - radius * math.sin(heading) * _PIXELS_PER_METRE
    y = SIZE / 2 - radius * math.cos(heading) * _PIXELS_PER_METRE
    return round(x * (1 << _SHIFT)), round(y * (1 << _SHIFT))
