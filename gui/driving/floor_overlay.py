"""Paints the path to the place that the pilot points at on the picture."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from PyQt5.QtCore import QPointF, Qt
from PyQt5.QtGui import QPainter, QPen, QPolygonF

from gui import theme
from gui.driving.floor_drive import ARRIVED
from gui.driving.floor_projection import pixel_of
from gui.ros.readings import CameraView

STEP, MOST_STEPS = 0.05, 400
"""[m] between two points of the band's edges, and how many there are at most."""
PixelToWidget = Callable[[float, float], QPointF]
"""Pixel (u, v) of the picture -> point of the widget that shows it."""


def paint_path(
    painter: QPainter,
    to_widget: PixelToWidget,
    view: CameraView,
    start: tuple[float, float],
    target: tuple[float, float],
    radius: float,
    tone: str,
) -> None:
    """Paint the band that the robot's body sweeps, and the place it ends at.

    Args:
        to_widget: Where the widget shows a pixel of the picture.
        start, target: In the frame of `view` [m].
        radius: The robot's [m].
        tone: Name of the theme's colour.
    """
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    here, there = np.array(start, float), np.array(target, float)
    length = float(np.linalg.norm(there - here))
    if length > 1e-3:
        along = (there - here) / length
        aside = np.array((-along[1], along[0])) * radius
        count = min(MOST_STEPS, math.ceil(length / STEP))
        steps = [here + along * (length * number / count) for number in range(count + 1)]
        left = [pixel_of(view, *(point + aside)) for point in steps]
        right = [pixel_of(view, *(point - aside)) for point in steps]
        edge = [to_widget(*pixel) for pixel in left if pixel] + [
            to_widget(*pixel) for pixel in reversed(right) if pixel
        ]
        painter.setPen(QPen(theme.colour(tone, 0.9), 2.0))
        painter.setBrush(theme.colour(tone, 0.28))
        painter.drawPolygon(QPolygonF(edge))
    ring = [
        pixel_of(view, *(there + ARRIVED * np.array((math.cos(turn), math.sin(turn)))))
        for turn in np.linspace(0.0, math.tau, 32)
    ]
    painter.setPen(QPen(Qt.GlobalColor.white, 2.0))
    painter.setBrush(theme.colour(tone, 0.55))
    painter.drawPolygon(QPolygonF([to_widget(*pixel) for pixel in ring if pixel]))
