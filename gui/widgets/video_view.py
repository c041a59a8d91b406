"""Shows the newest camera picture, and its age when no newer one comes."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

from PyQt5.QtCore import QPointF, QRectF, QSize, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QColor, QFont, QImage, QMouseEvent, QPainter, QPaintEvent
from PyQt5.QtWidgets import QFrame, QWidget

from gui import theme
from gui.periodic_timer import PeriodicTimer
from gui.ros.picture import Picture, as_qimage
from gui.widgets.picture_patience import PicturePatience

STALE_AFTER = 1.0
"""[s] without a new picture after which the last one is greyed out."""
STRAGGLERS = 0.3
"""[s] for which pictures still arrive whose program has ended: they wait in buffers."""
RATE_WINDOW = 2.0
CHECK_PERIOD = 100  # ms

_VEIL = QColor(13, 17, 22, 140)
_PLATE = QColor(13, 17, 22, 225)
_ON_PLATE = QColor("#c5cdd8")
_ALERT = QColor("#f0a53a")


class VideoView(QFrame):
    """Paints the newest picture as large as possible. Signals of the pointer are in pixels of the picture."""

    first_picture = pyqtSignal()
    """The first picture after `clear` has been painted."""
    late_changed = pyqtSignal(bool)
    """Whether the next picture takes too long to drive by the last one has changed (`gui.widgets.picture_patience`)."""
    stale_changed = pyqtSignal(bool)
    """Whether the picture counts as lost, and is greyed out, has changed."""
    status = pyqtSignal(str)
    """Size and rate of what is shown, for a label; changes at most every 100 ms."""
    pressed = pyqtSignal(float, float)
    """The left button was pressed on the picture [px of the picture]."""
    dragged = pyqtSignal(float, float)
    """The pointer was moved with the button held, maybe beyond the edge [px of the picture]."""
    released = pyqtSignal()
    """The button was released, or the widget was hidden."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)  # it paints all of itself, so nothing below it
        self._image: QImage | None = None
        self._arrivals: deque[float] = deque()
        self._arrived = self._stamp = 0.0
        self._late = self._stale = self._held = self._gone = False
        self._gone_until = -math.inf
        self._patience = PicturePatience()
        self._painted = self._announced = False
        self._title, self._hint, self._status = "", "", ""
        self.stale_after = STALE_AFTER
        """[s]; infinity for pictures that come only when something changes."""
        self._overlay: Callable[[QPainter, Callable[[float, float], QPointF]], None] | None = None
        self._checks = PeriodicTimer(CHECK_PERIOD, self._check, self)
        self._checks.start()
        self._late_timer = QTimer(self)
        self._late_timer.setSingleShot(True)
        self._late_timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._late_timer.timeout.connect(self._check_late)

    @property
    def late(self) -> bool:
        """Whether the next picture takes too long to drive by the last one."""
        return self._late

    @property
    def stale(self) -> bool:
        """Whether pictures came and have stopped."""
        return self._stale

    @property
    def image(self) -> QImage | None:
        """The picture that is shown, or None."""
        return self._image

    @property
    def stamp(self) -> float:
        """When the shown picture was taken [s since 1970]."""
        return self._stamp

    def sizeHint(self) -> QSize:
        return QSize(640, 480)

    def set_overlay(self, paint: Callable[[QPainter, Callable[[float, float], QPointF]], None] | None) -> None:
        """Paint something on every fresh picture: `paint(painter, to_widget)`, where `to_widget(u, v)` is the point of
        the widget that shows pixel (u, v) of the picture."""
        self._overlay = paint
        self.update()

    def show_picture(self, picture: Picture) -> None:
        """Show a picture in place of the one before. One that was taken when that one was, by its stamp, is no news: a
        camera that hangs sends its last picture again and again. A stamp of zero says nothing.

        Raises:
            ValueError: The encoding cannot be shown.
        """
        repeated = self._image is not None and picture.stamp == self._stamp != 0.0
        self._image = as_qimage(picture)
        self.update()
        if repeated:
            return
        self._arrived, self._stamp = picture.arrived, picture.stamp
        self._arrivals.append(picture.arrived)
        self._patience.note(picture.arrived)
        self._gone = self._gone and picture.arrived < self._gone_until
        self._set_stale(False)
        self._check_late()

    def clear(self, title: str, hint: str) -> None:
        """Show two lines of text instead of a picture: what is the matter, and what to do."""
        self._title, self._hint = title, hint
        self._image = None
        self._painted = self._announced = False
        self._arrivals.clear()
        self._patience.forget()
        self._gone = False
        self._let_go()
        self._set_stale(False)
        self._check_late()
        self._set_status("")
        self.update()

    def lose_source(self) -> None:
        """Let the picture count as late until the next one: the program that sends them has gone. What arrives within
        `STRAGGLERS` was under way before."""
        self._gone = self._image is not None
        self._gone_until = time.monotonic() + STRAGGLERS
        self._check_late()

    def age(self) -> float:
        """Return the time since the picture arrived [s]; infinity without one."""
        return time.monotonic() - self._arrived if self._image else float("inf")

    def rate(self) -> float:
        """Return the recent number of pictures per second; NaN after the first one, when it is unknown."""
        now = time.monotonic()
        while self._arrivals and now - self._arrivals[0] > RATE_WINDOW:
            self._arrivals.popleft()
        if len(self._arrivals) < 2:
            return math.nan if self._arrivals else 0.0
        return (len(self._arrivals) - 1) / max(1e-3, self._arrivals[-1] - self._arrivals[0])

    def pixel_at(self, point: QPointF) -> tuple[float, float]:
        """Return the pixel (u, v) of the picture at a point of the widget; outside the picture one beyond its edge.

        Raises:
            ValueError: There is no picture.
        """
        if self._image is None:
            raise ValueError("there is no picture")
        target = self._target(self._image)
        scale = self._image.width() / target.width()
        return (point.x() - target.left()) * scale, (point.y() - target.top()) * scale

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._image is not None:
            if self._target(self._image).contains(event.localPos()):
                self._held = True
                self.pressed.emit(*self.pixel_at(event.localPos()))
        super().mousePressEvent(event)  # a click moves the keyboard focus to the window

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._held and self._image is not None:
            self.dragged.emit(*self.pixel_at(event.localPos()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._let_go()

    def hideEvent(self, event: object) -> None:
        self._let_go()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.fillRect(self.rect(), theme.colour("well"))
        if self._image is None:
            self._paint_lines(painter, self._title, self._hint, theme.colour("text"), theme.colour("quiet"))
            return
        target = self._target(self._image)
        if self._stale:
            painter.drawImage(target, self._image.convertToFormat(QImage.Format.Format_Grayscale8))
            painter.fillRect(target, _VEIL)
            self._paint_lines(painter, "Picture lost", f"The last one is {self.age():.1f} s old.", _ALERT, _ON_PLATE)
        else:
            painter.drawImage(target, self._image)
            if self._overlay is not None:
                painter.setClipRect(target)
                scale = target.width() / self._image.width()
                self._overlay(painter, lambda u, v: QPointF(target.left() + u * scale, target.top() + v * scale))
        self._painted = True

    def _target(self, image: QImage) -> QRectF:
        """Return the largest rectangle with the picture's aspect ratio, centred."""
        scale = min(self.width() / image.width(), self.height() / image.height())
        width, height = image.width() * scale, image.height() * scale
        return QRectF((self.width() - width) / 2, (self.height() - height) / 2, width, height)

    def _paint_lines(self, painter: QPainter, title: str, hint: str, colour: QColor, quiet: QColor) -> None:
        painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        centre = QPointF(self.rect().center())
        if self._image is not None:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(_PLATE)
            painter.drawRoundedRect(QRectF(centre.x() - 150.0, centre.y() - 48.0, 300.0, 92.0), 10.0, 10.0)
        font = QFont(self.font())
        for text, size, tone, top in ((title, 20, colour, -34.0), (hint, 13, quiet, 6.0)):
            font.setPixelSize(size)
            painter.setFont(font)
            painter.setPen(tone)
            box = QRectF(24.0, centre.y() + top, self.width() - 48.0, 80.0)
            painter.drawText(
                box, Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap, text
            )

    def _check(self) -> None:
        if self._image is None:
            return
        if self._painted and not self._announced:
            self._announced = True
            self.first_picture.emit()
        self._set_stale(self.age() > self.stale_after)
        if self._stale:
            self.update()
            self._set_status(f"{self._image.width()} × {self._image.height()}   no new picture")
        else:
            rate = self.rate()
            often = "" if math.isnan(rate) else f"   {rate:.0f} pictures/s"
            self._set_status(f"{self._image.width()} × {self._image.height()}{often}")

    def _check_late(self) -> None:
        """Find out whether the next picture is late, and look again when it would be."""
        known = self._image is not None and math.isfinite(self.stale_after)
        left = 0.0 if self._gone else self._patience.seconds() - self.age() if known else math.inf
        if 0.0 < left < math.inf:
            self._late_timer.start(math.ceil(1000 * left))
        else:
            self._late_timer.stop()
        if (left <= 0.0) != self._late:
            self._late = left <= 0.0
            self.late_changed.emit(self._late)

    def _let_go(self) -> None:
        if self._held:
            self._held = False
            self.released.emit()

    def _set_stale(self, stale: bool) -> None:
        if stale != self._stale:
            self._stale = stale
            self.stale_changed.emit(stale)

    def _set_status(self, status: str) -> None:
        if status != self._status:
            self._status = status
            self.status.emit(status)
