"""The robot from above: what its sensors see, how fast it may drive in each direction, and where it came from."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

import numpy as np
from PyQt5.QtCore import QPointF, QRectF, QSize, Qt
from PyQt5.QtGui import (
    QColor,
    QPainter,
    QPainterPath,
    QPainterPathStroker,
    QPaintEvent,
    QPen,
    QPolygonF,
    QWheelEvent,
)
from PyQt5.QtWidgets import QFrame, QWidget

from gui import theme
from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import SECTORS, Beams, BodyState, Bumpers, Cone, Points, Safety
from gui.widgets.paced_updates import PacedUpdates
from telepresence.safety.outline import Outline

FORGET_AFTER = 1.0
"""[s] after which a reading is no longer shown."""
TRAIL_STEP = 0.03
TRAIL_LENGTH = 2000
"""[m] between two points of the trail, and how many are kept."""
NEAREST_VIEW, FARTHEST_VIEW = 0.5, 6.0
"""Limits of the zoom: half the width of the view [m]."""
RING_WIDTH = 9.0  # px
PAINT_PERIOD = 100  # ms; readings come 60 times a second, all sensors together
REFRESH_PERIOD = 250  # ms; old readings have to disappear even when no new ones come

_BUMPERS = {"left": 50.0, "right": -50.0, "back": 180.0}  # degrees from ahead


class SensorView(QFrame):
    """Paints readings in the base frame; ahead is up."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._points: dict[str, Points] = {}
        self._beams: dict[str, Beams] = {}
        self._cones: dict[str, Cone] = {}
        self._bumpers: Bumpers | None = None
        self._safety: Safety | None = None
        self._body: BodyState | None = None
        self._target: tuple[float, float] | None = None
        self._trail: deque[tuple[float, float]] = deque(maxlen=TRAIL_LENGTH)
        self.set_robot(Outline.disc(0.25), 0.35, 1.8)
        self.setMinimumSize(180, 180)
        self.setToolTip("The robot from above. Ring: speed allowed in each direction. Turn the wheel to zoom.")
        self._handlers: dict[type, Callable] = {
            Points: lambda reading: self._points.update({reading.source: reading}),
            Beams: lambda reading: self._beams.update({reading.source: reading}),
            Cone: lambda reading: self._cones.update({reading.source: reading}),
            Bumpers: lambda reading: setattr(self, "_bumpers", reading),
            Safety: lambda reading: setattr(self, "_safety", reading),
            BodyState: self._on_body,
        }
        self._updates = PacedUpdates(self, PAINT_PERIOD)
        self._refresh = PeriodicTimer(REFRESH_PERIOD, self._updates.ask, self)
        self._refresh.start()

    def sizeHint(self) -> QSize:
        return QSize(240, 240)

    def set_robot(self, outline: Outline, top_speed: float, reach: float) -> None:
        """Show a robot, and forget all readings of the one before.

        Args:
            outline: Its shape on the floor.
            top_speed: [m/s]; what the ring shows as free.
            reach: Half the width of the view at first [m].
        """
        self._shape = _shape_of(outline)
        self._radius = outline.outer_radius
        self._top_speed, self._reach = top_speed, reach
        self.clear()

    def clear(self) -> None:
        """Forget all readings, and the trail."""
        for kept in (self._points, self._beams, self._cones, self._trail):
            kept.clear()
        self._bumpers = self._safety = self._body = self._target = None
        self.update()

    def show_reading(self, reading: object) -> None:
        """Show a reading; kinds that are not painted here are ignored."""
        keep = self._handlers.get(type(reading))
        if keep is not None:
            keep(reading)
            self._updates.ask()

    def show_target(self, target: tuple[float, float] | None) -> None:
        """Mark the place that is driven to, in odom [m]."""
        self._target = target
        self.update()

    @property
    def trail(self) -> list[tuple[float, float]]:
        """Positions in odom [m], oldest first."""
        return list(self._trail)

    def _on_body(self, body: BodyState) -> None:
        self._body = body
        here = (body.x, body.y)
        if self._trail and math.dist(self._trail[-1], here) > 1.0:
            self._trail.clear()  # the odometry was reset
        if not self._trail or math.dist(self._trail[-1], here) > TRAIL_STEP:
            self._trail.append(here)

    def wheelEvent(self, event: QWheelEvent) -> None:
        factor = 0.85 if event.angleDelta().y() > 0 else 1.0 / 0.85
        self._reach = min(FARTHEST_VIEW, max(NEAREST_VIEW, self._reach * factor))
        self.update()

    # --- painting ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        side = min(self.width(), self.height()) - 2.0
        self._scale = (side / 2 - RING_WIDTH) / self._reach
        centre = QPointF(self.width() / 2, self.height() / 2)
        disc = QPainterPath()
        disc.addEllipse(centre, side / 2, side / 2)
        painter.fillPath(disc, theme.colour("floor"))
        painter.save()
        painter.setClipPath(disc)
        painter.translate(centre)
        for layer in (
            self._paint_grid, self._paint_trail, self._paint_cones, self._paint_beams, self._paint_robot,
            self._paint_points, self._paint_bumpers, self._paint_gap, self._paint_motion, self._paint_target,
        ):  # fmt: skip
            layer(painter)
        painter.restore()
        painter.translate(centre)
        self._paint_ring(painter, side / 2)

    def _px(self, x: float, y: float) -> QPointF:
        """Convert a position in the base frame [m] to pixels from the centre."""
        return QPointF(-y * self._scale, -x * self._scale)

    def _paint_grid(self, painter: QPainter) -> None:
        step = next((step for step in (0.25, 0.5, 1.0, 2.0) if self._reach / step <= 4.0), 2.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        font = painter.font()
        font.setPixelSize(10)
        painter.setFont(font)
        for number in range(1, math.ceil(self._reach / step)):
            radius = number * step * self._scale
            painter.setPen(QPen(theme.colour("grid"), 1.0))
            painter.drawEllipse(QPointF(0, 0), radius, radius)
            painter.setPen(theme.colour("faint"))
            at = QPointF(-radius * math.sin(2.5), -radius * math.cos(2.5))
            painter.drawText(
                QRectF(at.x() - 24, at.y() - 7, 48, 14), Qt.AlignmentFlag.AlignCenter, f"{number * step:g} m"
            )
        painter.setPen(QPen(theme.colour("grid"), 1.0))
        far = self._reach * self._scale
        painter.drawLine(QPointF(0, -far), QPointF(0, far))
        painter.drawLine(QPointF(-far, 0), QPointF(far, 0))

    def _paint_trail(self, painter: QPainter) -> None:
        if self._body is None or len(self._trail) < 2:
            return
        at = _to_base(self._body, np.array([*self._trail, (self._body.x, self._body.y)]))
        line = QPolygonF([self._px(x, y) for x, y in at])
        painter.setPen(
            QPen(
                theme.colour("trail", 0.55),
                2.0,
                Qt.PenStyle.SolidLine,
                Qt.PenCapStyle.RoundCap,
                Qt.PenJoinStyle.RoundJoin,
            )
        )
        painter.drawPolyline(line)

    def _paint_cones(self, painter: QPainter) -> None:
        for cone in self._fresh(self._cones):
            seen = cone.range if math.isfinite(cone.range) else cone.reach
            if math.isnan(cone.range):
                continue
            hit = math.isfinite(cone.range)
            tone = theme.colour("sonar", 0.22 if hit else 0.08)
            middle, radius = self._px(cone.x, cone.y), seen * self._scale
            box = QRectF(middle.x() - radius, middle.y() - radius, 2 * radius, 2 * radius)
            start = 90.0 + math.degrees(cone.bearing - cone.width / 2)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(tone)
            painter.drawPie(box, round(start * 16), round(math.degrees(cone.width) * 16))
            if hit:
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.setPen(QPen(theme.colour("sonar"), 2.0))
                painter.drawArc(box, round(start * 16), round(math.degrees(cone.width) * 16))

    def _paint_beams(self, painter: QPainter) -> None:
        for beams in self._fresh(self._beams):
            for (x, y), bearing, distance in zip(beams.starts, beams.bearings, beams.ranges, strict=True):
                if math.isnan(distance):
                    continue
                hit = math.isfinite(distance)
                length = distance if hit else beams.reach
                end = self._px(x + length * math.cos(bearing), y + length * math.sin(bearing))
                painter.setPen(QPen(theme.colour("infrared", 0.9 if hit else 0.25), 3.0 if hit else 2.0))
                painter.drawLine(self._px(x, y), end)
                if hit:
                    painter.setPen(Qt.PenStyle.NoPen)
                    painter.setBrush(theme.colour("infrared"))
                    painter.drawEllipse(end, 3.5, 3.5)

    def _paint_points(self, painter: QPainter) -> None:
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("laser"))
        for points in self._fresh(self._points):
            for x, y in points.at:
                painter.drawEllipse(self._px(x, y), 2.2, 2.2)

    def _paint_robot(self, painter: QPainter) -> None:
        painter.save()
        painter.rotate(-90.0)  # x of the base frame is up
        painter.scale(self._scale, -self._scale)
        pen = QPen(theme.colour("bodyline"), 1.5)
        pen.setCosmetic(True)
        painter.setPen(pen)
        painter.setBrush(theme.colour("body"))
        painter.drawPath(self._shape)
        painter.restore()
        nose = 0.38 * self._radius
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("accent"))
        tip = [self._px(nose, 0), self._px(-0.1 * nose, 0.55 * nose), self._px(0.1 * nose, 0)]
        painter.drawPolygon(QPolygonF([*tip, self._px(-0.1 * nose, -0.55 * nose)]))

    def _paint_bumpers(self, painter: QPainter) -> None:
        if self._bumpers is None or not self._bumpers.pressed:
            return
        radius = self._radius * self._scale + 4.0
        box = QRectF(-radius, -radius, 2 * radius, 2 * radius)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(theme.colour("blocked"), 6.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap))
        for name in self._bumpers.pressed:
            if name in _BUMPERS:
                painter.drawArc(box, round((90.0 + _BUMPERS[name] - 35.0) * 16), 70 * 16)
            else:
                painter.drawEllipse(box)

    def _paint_gap(self, painter: QPainter) -> None:
        """Paint a line from the outline to the thing that limits the speed most."""
        safety = self._fresh_safety()
        if safety is None or safety.sector is None or not math.isfinite(safety.gap) or safety.gap > self._reach:
            return
        bearing = safety.sector * math.tau / SECTORS
        near, far = self._radius, self._radius + safety.gap
        painter.setPen(QPen(theme.colour("bad"), 1.5, Qt.PenStyle.DashLine))
        painter.drawLine(
            self._px(near * math.cos(bearing), near * math.sin(bearing)),
            self._px(far * math.cos(bearing), far * math.sin(bearing)),
        )

    def _paint_motion(self, painter: QPainter) -> None:
        """Paint the velocity that the wheels are given: as far as in two seconds."""
        safety = self._fresh_safety()
        if safety is None:
            return
        vx, vy, wz = safety.given
        painter.setPen(QPen(theme.colour("accent"), 3.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        speed = math.hypot(vx, vy)
        if speed > 0.005:
            start = self._radius / speed
            tip = self._px(vx * start + 2.0 * vx, vy * start + 2.0 * vy)
            painter.drawLine(self._px(vx * start, vy * start), tip)
            painter.setBrush(theme.colour("accent"))
            painter.drawEllipse(tip, 3.0, 3.0)
        if abs(wz) > 0.01:
            radius = self._radius * self._scale * 0.75
            box = QRectF(-radius, -radius, 2 * radius, 2 * radius)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawArc(box, 90 * 16, round(math.degrees(wz) * 16))

    def _paint_target(self, painter: QPainter) -> None:
        if self._target is None or self._body is None:
            return
        at = self._px(*_to_base(self._body, np.array([self._target]))[0])
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(theme.colour("accent"), 2.0))
        painter.drawEllipse(at, 6.0, 6.0)
        painter.drawLine(self._px(0, 0), at)

    def _paint_ring(self, painter: QPainter, radius: float) -> None:
        safety = self._fresh_safety()
        middle = radius - RING_WIDTH / 2
        box = QRectF(-middle, -middle, 2 * middle, 2 * middle)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        width = 360.0 / SECTORS
        if safety is None:
            painter.setPen(QPen(theme.colour("line"), RING_WIDTH - 3.0))
            painter.drawEllipse(box)
            return
        for sector, speed in enumerate(safety.allowed):
            painter.setPen(
                QPen(self.ring_colour(float(speed)), RING_WIDTH - 2.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap)
            )
            start = 90.0 + (sector - 0.5) * width
            painter.drawArc(box, round((start + 0.4) * 16), round((width - 0.8) * 16))

    def ring_colour(self, speed: float) -> QColor:
        """Return red where nothing is allowed, amber to green with the allowed speed [m/s], grey if it is unknown."""
        if not math.isfinite(speed):
            return theme.colour("line")
        share = speed / self._top_speed
        if share < 0.05:
            return theme.colour("blocked")
        if share < 0.95:
            return theme.colour("slow", 0.55 + 0.45 * (1.0 - share))
        return theme.colour("free", 0.75)

    def _fresh_safety(self) -> Safety | None:
        safety = self._safety
        return safety if safety is not None and time.monotonic() - safety.arrived < FORGET_AFTER else None

    @staticmethod
    def _fresh(kept: dict) -> list:
        now = time.monotonic()
        return [reading for reading in kept.values() if now - reading.arrived < FORGET_AFTER]


def _to_base(body: BodyState, points: np.ndarray) -> np.ndarray:
    """Convert points (n, 2) from odom to the base frame of a body in this pose [m]."""
    c, s = math.cos(body.yaw), math.sin(body.yaw)
    return (points - np.array((body.x, body.y))) @ np.array(((c, -s), (s, c)))


def _shape_of(outline: Outline) -> QPainterPath:
    """Return the outline as a path in the base frame [m]."""
    path = QPainterPath()
    if len(outline.vertices) == 1:
        path.addEllipse(QPointF(*outline.vertices[0]), outline.radius, outline.radius)
        return path
    path.addPolygon(QPolygonF([QPointF(x, y) for x, y in (*outline.vertices, outline.vertices[0])]))
    around = QPainterPathStroker()
    around.setWidth(2.0 * outline.radius)
    around.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    around.setCapStyle(Qt.PenCapStyle.RoundCap)
    around.setCurveThreshold(0.001)
    return path.united(around.createStroke(path)).simplified()
