"""Shows a QR code."""

from __future__ import annotations

from PyQt5.QtCore import QRect
from PyQt5.QtGui import QColor, QImage, QPainter, QPaintEvent
from PyQt5.QtWidgets import QWidget


class QrCode(QWidget):
    """A QR code, black on white in every theme."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._image: QImage | None = None

    def show_rows(self, rows: list[str]) -> None:
        """Show a code; a row of "1" for dark and "0" for light each. Nothing for no rows."""
        self._image = QImage(len(rows), len(rows), QImage.Format.Format_RGB32) if rows else None
        for y, row in enumerate(rows):
            for x, dark in enumerate(row):
                assert self._image is not None  # there are rows
                self._image.setPixelColor(x, y, QColor("black" if dark == "1" else "white"))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        if self._image is None:
            return
        size = min(self.width(), self.height()) // self._image.width() * self._image.width()  # whole pixels a module
        target = QRect((self.width() - size) // 2, (self.height() - size) // 2, size, size)
        painter = QPainter(self)
        painter.drawImage(target, self._image)
        painter.end()
