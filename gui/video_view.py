"""Shows the newest camera picture, and how old it is when no newer one comes."""

from __future__ import annotations

import time
from collections import deque

from PyQt5.QtCore import QPointF, QRectF, QSize, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QColor, QFont, QImage, QPainter, QPaintEvent
from PyQt5.QtWidgets import QFrame, QWidget

from gui.picture import Picture, as_qimage

STALE_AFTER = 1.0
"""Seconds without a new picture after which the last one is greyed."""
RATE_WINDOW = 2.0
CHECK_PERIOD = 100  # ms

_BACKGROUND = QColor("#0d1116")
_VEIL = QColor(13, 17, 22, 140)
_PLATE = QColor(13, 17, 22, 225)
_TEXT = QColor("#e6eaf0")
_DETAIL = QColor("#8a96a8")
_ALERT = QColor("#f0a53a")


class VideoView(QFrame):
    """Paints the newest picture as large as it fits."""

    first_picture = pyqtSignal()
    """The first picture after `clear` has been painted."""
    stale_changed = pyqtSignal(bool)
    """The picture has become too old, or fresh again."""
    status = pyqtSignal(str)
    """Size and rate of what is shown, for a label; changes at most every 100 ms."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._image: QImage | None = None
        self._arrivals: deque[float] = deque()
        self._arrived = 0.0
        self._stale = False
        self._painted = self._announced = False
        self._title, self._hint, self._status = "", "", ""
        self._checks = QTimer(self, interval=CHECK_PERIOD)
        self._checks.timeout.connect(self._check)
        self._checks.start()

    @property
    def stale(self) -> bool:
        """Whether pictures came and have ceased."""
        return self._stale

    def sizeHint(self) -> QSize:
        return QSize(640, 480)

    def show_picture(self, picture: Picture) -> None:
        """Show it in place of the one before.

        Raises:
            ValueError: The encoding cannot be shown.
        """
        self._image = as_qimage(picture)
        self._arrived = picture.arrived
        self._arrivals.append(picture.arrived)
        self._set_stale(False)
        self.update()

    def clear(self, title: str, hint: str) -> None:
        """Show no picture but two lines of text: what is the case, and what to do."""
        self._title, self._hint = title, hint
        self._image = None
        self._painted = self._announced = False
        self._arrivals.clear()
        self._set_stale(False)
        self._set_status("")
        self.update()

    def age(self) -> float:
        """Seconds since the picture arrived; infinity without one."""
        return time.monotonic() - self._arrived if self._image else float("inf")

    def rate(self) -> float:
        """Pictures per second, lately."""
        now = time.monotonic()
        while self._arrivals and now - self._arrivals[0] > RATE_WINDOW:
            self._arrivals.popleft()
        if len(self._arrivals) < 2:
            return 0.0
        return (len(self._arrivals) - 1) / max(1e-3, self._arrivals[-1] - self._arrivals[0])

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.SmoothPixmapTransform)
        painter.fillRect(self.rect(), _BACKGROUND)
        if self._image is None:
            self._paint_lines(painter, self._title, self._hint, _TEXT)
            return
        target = self._target(self._image)
        if self._stale:
            painter.drawImage(target, self._image.convertToFormat(QImage.Format_Grayscale8))
            painter.fillRect(target, _VEIL)
            self._paint_lines(painter, "Picture lost", f"The last one is {self.age():.1f} s old.", _ALERT)
        else:
            painter.drawImage(target, self._image)
        self._painted = True

    def _target(self, image: QImage) -> QRectF:
        """The largest rectangle of the picture's shape, centred."""
        scale = min(self.width() / image.width(), self.height() / image.height())
        width, height = image.width() * scale, image.height() * scale
        return QRectF((self.width() - width) / 2, (self.height() - height) / 2, width, height)

    def _paint_lines(self, painter: QPainter, title: str, hint: str, colour: QColor) -> None:
        painter.setRenderHint(QPainter.TextAntialiasing)
        centre = QPointF(self.rect().center())
        if self._image is not None:
            painter.setRenderHint(QPainter.Antialiasing)
            painter.setPen(Qt.NoPen)
            painter.setBrush(_PLATE)
            painter.drawRoundedRect(QRectF(centre.x() - 150.0, centre.y() - 48.0, 300.0, 92.0), 10.0, 10.0)
        font = QFont(self.font())
        for text, size, tone, top in ((title, 15, colour, -34.0), (hint, 10, _DETAIL, 6.0)):
            font.setPointSize(size)
            painter.setFont(font)
            painter.setPen(tone)
            box = QRectF(24.0, centre.y() + top, self.width() - 48.0, 80.0)
            painter.drawText(box, Qt.AlignHCenter | Qt.AlignTop | Qt.TextWordWrap, text)

    def _check(self) -> None:
        if self._image is None:
            return
        if self._painted and not self._announced:
            self._announced = True
            self.first_picture.emit()
        self._set_stale(self.age() > STALE_AFTER)
        if self._stale:
            self.update()
            self._set_status(f"{self._image.width()} × {self._image.height()}   no new picture")
        else:
            self._set_status(f"{self._image.width()} × {self._image.height()}   {self.rate():.0f} pictures/s")

    def _set_stale(self, stale: bool) -> None:
        if stale != self._stale:
            self._stale = stale
            self.stale_changed.emit(stale)

    def _set_status(self, status: str) -> None:
        if status != self._status:
            self._status = status
            self.status.emit(status)
