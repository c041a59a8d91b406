"""Paints the path to the place that the pilot points at on the picture."""

from __future__ import annotations

from collections.abc import Callable

from PyQt5.QtCore import QPointF, Qt
from PyQt5.QtGui import QPainter, QPen, QPolygonF

from gui import theme
from gui.ros.readings import CameraView
from telepresence.teleop.floor_band import floor_band

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
    band = floor_band(view, start, target, radius)
    for corners, edge, colour in (
        (band.edge, theme.colour(tone, 0.9), theme.colour(tone, 0.28)),
        (band.ring, Qt.GlobalColor.white, theme.colour(tone, 0.55)),
    ):
        if corners:
            painter.setPen(QPen(edge, 2.0))
            painter.setBrush(colour)
            painter.drawPolygon(QPolygonF([to_widget(*pixel) for pixel in corners]))
