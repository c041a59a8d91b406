"""A plain window that shows the newest picture as large as it fits, and how old it is when no newer one comes."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from PyQt5.QtCore import Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QKeyEvent
from PyQt5.QtWidgets import QApplication, QVBoxLayout, QWidget

from gui.ros.picture import Picture
from gui.widgets.video_view import VideoView
from telepresence.video.images import LatestImage, read_image_message

log = logging.getLogger(__name__)

CHECK_PERIOD = 100  # ms between two looks whether the program shall end


class PictureWindow(QWidget):
    """Shows the sensor_msgs/Image messages of `newest`."""

    _arrived = pyqtSignal()

    def __init__(self, newest: LatestImage, title: str) -> None:
        super().__init__()
        self._newest = newest
        self._sequence = 0
        self._pending = False
        self._complaint = ""
        self._view = VideoView(self)
        self._view.clear("Waiting for the robot's picture", title)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._view)
        self.setWindowTitle(title)
        self.resize(960, 720)
        self._arrived.connect(self._show_newest)
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
        message = picture.pixels
        try:
            pixels = read_image_message(message)
            arrived = time.monotonic() - self._newest.age()
            self._view.show_picture(Picture(pixels, message.encoding, picture.stamp, arrived))
        except ValueError as error:
            if str(error) != self._complaint:
                log.error("the picture cannot be shown: %s", error)
                self._complaint = str(error)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key_F:
            self.setWindowState(self.windowState() ^ Qt.WindowFullScreen)
        elif event.key() == Qt.Key_Escape:
            self.setWindowState(self.windowState() & ~Qt.WindowFullScreen)
        elif event.key() == Qt.Key_Q:
            self.close()


def run_window(newest: LatestImage, title: str, ended: Callable[[], bool]) -> int:
    """Show the window until somebody closes it or `ended()`; the exit code for the process."""
    application = QApplication([title])
    window = PictureWindow(newest, title)
    window.show()
    checks = QTimer(interval=CHECK_PERIOD)
    checks.timeout.connect(lambda: ended() and application.quit())
    checks.start()
    return application.exec_()
