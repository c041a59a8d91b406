"""Shows the attitude of the robot as an artificial horizon, and position, heading and speed as numbers."""

from __future__ import annotations

import math
import time
from typing import TypeVar

from PyQt5.QtCore import QPointF, QRectF, QSize, Qt
from PyQt5.QtGui import QPainter, QPainterPath, QPaintEvent, QPen
from PyQt5.QtWidgets import QFrame, QWidget

from gui import theme
from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import BodyState, TruePose
from gui.widgets.paced_updates import PacedUpdates

PAINT_PERIOD = 200  # ms; the odometry alone comes 20 times a second
FORGET_AFTER = 1.0
"""[s] after which a reading is no longer shown."""
FULL_SCALE = math.radians(20.0)
"""Pitch at the rim of the horizon [rad]."""
WIDEST = 170.0
"""Width of the lines of text at most [px]: a name has to stay near its value."""

_Reading = TypeVar("_Reading", BodyState, TruePose)


class BodyPanel(QFrame):
    """Paints the newest `BodyState`, with a simulated robot's `TruePose` as numbers; or that alone."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._body: BodyState | None = None
        self._true: TruePose | None = None
        self.setMinimumSize(112, 160)
        self.setToolTip("Attitude of the body (roll and pitch), position and heading by odometry, speed")
        self._updates = PacedUpdates(self, PAINT_PERIOD)
        self._refresh = PeriodicTimer(500, self._updates.ask, self)
        self._refresh.start()

    def sizeHint(self) -> QSize:
        return QSize(116, 210)

    def show_reading(self, reading: object) -> None:
        """Show a `BodyState` or a `TruePose`; other readings are ignored."""
        if isinstance(reading, BodyState):
            self._body = reading
        elif isinstance(reading, TruePose):
            self._true = reading
        else:
            return
        self._updates.ask()

    def clear(self) -> None:
        self._body = self._true = None
        self.update()

    def lines(self) -> list[tuple[str, str]]:
        """Return the lines of text: name and value."""
        body, true = _fresh(self._body), _fresh(self._true)
        if body is None and true is not None:
            return [
                ("x", f"{_signed(true.x, 2)} m"),
                ("y", f"{_signed(true.y, 2)} m"),
                ("z", f"{_signed(true.z, 2)} m"),
                ("roll", f"{_signed(math.degrees(true.roll), 1)}°"),
                ("pitch", f"{_signed(math.degrees(true.pitch), 1)}°"),
                ("yaw", f"{_signed(math.degrees(true.yaw), 1)}°"),
            ]
        if body is None:
            return [(name, "–") for name in ("roll, pitch", "x, y", "heading", "speed", "turning")]
        truth = [] if true is None else [("truth", f"{_signed(true.x, 2)} {_signed(true.y, 2)}")]
        return [
            ("roll, pitch", f"{_signed(math.degrees(body.roll), 0)}° {_signed(math.degrees(body.pitch), 0)}°"),
            ("x, y", f"{_signed(body.x, 2)} {_signed(body.y, 2)}"),
            ("heading", f"{_signed(math.degrees(body.yaw), 0)}°"),
            ("speed", f"{math.hypot(body.vx, body.vy):.2f} m/s"),
            ("turning", f"{_signed(math.degrees(body.wz), 0)} °/s"),
            *truth,
        ]

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        lines = self.lines()
        row = 17.0
        text_height = row * len(lines)
        radius = max(24.0, min(self.width() - 8.0, self.height() - text_height - 10.0, 150.0) / 2)
        self._paint_horizon(
            painter, QPointF(self.width() / 2, radius + 2.0), radius, _fresh(self._body) or _fresh(self._true)
        )
        top = max(2 * radius + 8.0, self.height() - text_height - 2.0)
        font = painter.font()
        font.setPixelSize(11)
        painter.setFont(font)
        wide = min(self.width() - 4.0, WIDEST)
        for index, (name, value) in enumerate(lines):
            box = QRectF((self.width() - wide) / 2, top + index * row, wide, row)
            painter.setPen(theme.colour("quiet"))
            painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, name)
            painter.setPen(theme.colour("text"))
            painter.drawText(box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, value)

    def _paint_horizon(
        self, painter: QPainter, centre: QPointF, radius: float, body: BodyState | TruePose | None
    ) -> None:
        painter.save()
        disc = QPainterPath()
        disc.addEllipse(centre, radius, radius)
        painter.setClipPath(disc)
        painter.translate(centre)
        painter.fillRect(QRectF(-radius, -radius, 2 * radius, 2 * radius), theme.colour("floor"))
        if body is not None:
            painter.save()
            # Nose down (positive pitch, REP 103) lifts the horizon; rolling right tips it to the left.
            painter.rotate(-math.degrees(body.roll))
            drop = -max(-1.0, min(1.0, body.pitch / FULL_SCALE)) * radius
            far = 3 * radius
            painter.fillRect(QRectF(-far, -far + drop, 2 * far, far), theme.colour("accent", 0.30))
            painter.fillRect(QRectF(-far, drop, 2 * far, far), theme.colour("slow", 0.30))
            painter.setPen(QPen(theme.colour("strong"), 1.5))
            painter.drawLine(QPointF(-far, drop), QPointF(far, drop))
            painter.setPen(QPen(theme.colour("quiet"), 1.0))
            for degrees in (-10, 10):
                y = drop - math.radians(degrees) / FULL_SCALE * radius
                painter.drawLine(QPointF(-0.25 * radius, y), QPointF(0.25 * radius, y))
            painter.restore()
            painter.setPen(QPen(theme.colour("accent"), 2.5, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
            painter.drawLine(QPointF(-0.6 * radius, 0), QPointF(-0.2 * radius, 0))
            painter.drawLine(QPointF(0.2 * radius, 0), QPointF(0.6 * radius, 0))
            painter.drawEllipse(QPointF(0, 0), 2.0, 2.0)
        painter.restore()
        painter.setPen(QPen(theme.colour("line"), 1.5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(centre, radius, radius)


def _fresh(reading: _Reading | None) -> _Reading | None:
    return reading if reading is not None and time.monotonic() - reading.arrived <= FORGET_AFTER else None


def _signed(value: float, digits: int) -> str:
    """Format a number with its sign, and with a minus as wide as the plus."""
    text = f"{round(value, digits) + 0.0:+.{digits}f}"  # -0.0 + 0.0 is 0.0
    return text.replace("-", "−")
