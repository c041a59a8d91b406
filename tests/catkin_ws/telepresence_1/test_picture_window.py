"""The plain window for the robot's picture: shows the newest one, greys an old one, goes to full screen and back."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from offscreen_qt import application
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication
from telepresence_1 import picture_window
from telepresence_1.picture_window import PictureWindow

from telepresence.video.images import LatestImage, fill_image_message

ORANGE = (240, 120, 20)


@pytest.fixture(scope="session")
def qt() -> QApplication:
    return application()


@pytest.fixture
def newest() -> LatestImage:
    return LatestImage()


@pytest.fixture
def window(qt: QApplication, newest: LatestImage) -> Iterator[PictureWindow]:
    window = PictureWindow(newest, "/camera")
    window.show()
    yield window
    window.close()
    window.deleteLater()
    qt.processEvents()


def message(pixels: np.ndarray, encoding: str) -> SimpleNamespace:
    return fill_image_message(SimpleNamespace(), pixels, encoding)


def centre(window: PictureWindow) -> tuple[int, ...]:
    QApplication.processEvents()
    colour = window.grab().toImage().pixelColor(window.rect().center())
    return colour.red(), colour.green(), colour.blue()


def test_the_newest_picture_is_shown(window, newest):
    newest.put(message(np.full((24, 32, 3), ORANGE, np.uint8), "rgb8"))
    assert centre(window) == ORANGE
    newest.put(message(np.full((24, 32), 77, np.uint8), "mono8"))
    assert centre(window) == (77, 77, 77)


def test_an_old_picture_is_grey(window, newest, monkeypatch):
    newest.put(message(np.full((24, 32, 3), ORANGE, np.uint8), "rgb8"))
    assert centre(window) == ORANGE
    monkeypatch.setattr(picture_window, "STALE_AFTER", 0.0)
    colour = window.grab().toImage().pixelColor(5, window.height() // 2)
    assert abs(colour.red() - colour.blue()) < 15


def test_a_picture_that_cannot_be_shown_is_reported_once(window, newest, caplog):
    for _ in range(3):
        newest.put(SimpleNamespace(encoding="yuv422", width=2, height=2, step=4, is_bigendian=0, data=bytes(8)))
        QApplication.processEvents()
    assert caplog.text.count("cannot be shown") == 1 and "yuv422" in caplog.text


def test_f_is_full_screen_and_escape_is_not(window):
    QTest.keyClick(window, Qt.Key_F)
    assert window.windowState() & Qt.WindowFullScreen
    QTest.keyClick(window, Qt.Key_Escape)
    assert not window.windowState() & Qt.WindowFullScreen
    QTest.keyClick(window, Qt.Key_Q)
    assert not window.isVisible()
