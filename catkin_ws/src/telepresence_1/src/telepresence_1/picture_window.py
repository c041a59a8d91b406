"""A plain window that shows the newest picture as large as it fits, and how old it is when no newer one comes."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np
from PyQt5.QtCore import QRectF, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QColor, QImage, QKeyEvent, QPainter, QPaintEvent
from PyQt5.QtWidgets import QApplication, QWidget

from telepresence.video.displayable import as_bgr
from telepresence.video.images import LatestImage, read_image_message

log = logging.getLogger(__name__)

STALE_AFTER = 1.0
"""Seconds without a new picture after which the last one is greyed."""
CHECK_PERIOD = 100
"""Milliseconds between two checks of the picture's age, and of whether the program shall end."""
_GROUND, _VEIL, _TEXT, _ALERT = QColor("#0d1116"), QColor(13, 17, 22, 140), QColor("#c5cdd8"), QColor("#f0a53a")


class PictureWindow(QWidget):
    """Shows the sensor_msgs/Image messages of `newest`."""

    _arrived = pyqtSignal()

    def __init__(self, newest: LatestImage, title: str) -> None:
        super().__init__()
        self._newest = newest
        self._title = title
        self._image: QImage | None = None
        self._sequence = 0
        self._pending = False
        self._complaint = ""
        self.setWindowTitle(f"image1: {title}")  # as the report's window is called
        self.resize(960, 720)
        self._arrived.connect(self._show_newest)
        self._ages = QTimer(self)
        self._ages.timeout.connect(self._check_age)
        self._ages.start(CHECK_PERIOD)
        newest.add_listener(self._notify)

    def _notify(self) -> None:  # on the thread that brings the pictures
        if not self._pending:  # one signal on its way is enough, else they queue up while the window is busy
            self._pending = True
            self._arrived.emit()

    def _show_newest(self) -> None:
        self._pending = False
        picture = self._newest.peek()
        if picture is None or picture.sequence == self._sequence:
            return
        self._sequence = picture.sequence
        message = picture.content
        try:
            self._image = as_qimage(as_bgr(read_image_message(message), message.encoding))
        except ValueError as error:
            if str(error) != self._complaint:
                log.error("the picture cannot be shown: %s", error)
                self._complaint = str(error)
        self.update()

    def _check_age(self) -> None:
        if self._newest.age() > STALE_AFTER:
            self.update()

    def paintEvent(self, _event: QPaintEvent | None) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.fillRect(self.rect(), _GROUND)
        image = self._image
        if image is None:
            self._write(painter, _TEXT, f"Waiting for the robot's picture\n{self._title}")
            return
        scale = min(self.width() / image.width(), self.height() / image.height())
        width, height = image.width() * scale, image.height() * scale
        target = QRectF((self.width() - width) / 2, (self.height() - height) / 2, width, height)
        age = self._newest.age()
        if age <= STALE_AFTER:
            painter.drawImage(target, image)
            return
        painter.drawImage(target, image.convertToFormat(QImage.Format.Format_Grayscale8))
        painter.fillRect(target, _VEIL)
        self._write(painter, _ALERT, f"Picture lost\nThe last one is {age:.1f} s old.")

    def _write(self, painter: QPainter, colour: QColor, text: str) -> None:
        font = self.font()
        font.setPixelSize(20)
        painter.setFont(font)
        painter.setPen(colour)
        painter.drawText(self.rect(), int(Qt.AlignmentFlag.AlignCenter) | int(Qt.TextFlag.TextWordWrap), text)

    def keyPressEvent(self, event: QKeyEvent | None) -> None:
        key = event.key() if event is not None else None
        if key == Qt.Key.Key_F:
            self.setWindowState(self.windowState() ^ Qt.WindowState.WindowFullScreen)
        elif key == Qt.Key.Key_Escape:
            self.setWindowState(self.windowState() & ~Qt.WindowStates(Qt.WindowState.WindowFullScreen))
        elif key == Qt.Key.Key_Q:
            self.close()


def as_qimage(pixels: np.ndarray) -> QImage:
    """Return what `as_bgr` returned as Qt paints it, with pixels of its own."""
    pixels = np.ascontiguousarray(pixels)
    height, width = pixels.shape[:2]
    kind = QImage.Format.Format_BGR888 if pixels.ndim == 3 else QImage.Format.Format_Grayscale8
    return QImage(pixels.tobytes(), width, height, pixels.strides[0], kind).copy()


def run_window(newest: LatestImage, title: str, ended: Callable[[], bool]) -> int:
    """Show the window until somebody closes it or `ended()`; the exit code for the process."""
    application = QApplication([title])
    window = PictureWindow(newest, title)
    window.show()

    def check() -> None:
        if ended():
            application.quit()

    checks = QTimer()
    checks.timeout.connect(check)
    checks.start(CHECK_PERIOD)
    return application.exec_()
