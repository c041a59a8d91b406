from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from telepresence_1.page import create_app

from telepresence.video.images import LatestImage
from telepresence.video.mjpeg import MjpegStream
from telepresence.web.server import WebServer


def jpeg(colour: tuple[int, int, int], width: int = 640, height: int = 480) -> bytes:
    """One colour, RGB."""
    return cv2.imencode(".jpg", np.full((height, width, 3), colour[::-1], np.uint8))[1].tobytes()


@pytest.fixture(name="jpeg")
def _jpeg() -> Callable[..., bytes]:
    return jpeg


@pytest.fixture
def open_page() -> Iterator[Callable[..., SimpleNamespace]]:
    """Serve the page on a free port; returns its `image`, `stream`, `server`, and `state` to be changed at will."""
    servers: list[WebServer] = []

    def open_page(
        *,
        port: int = 0,
        image: LatestImage | None = None,
        max_viewers: int = 16,
        timeout: float = 10.0,
        **options: object,
    ) -> SimpleNamespace:
        page = SimpleNamespace(image=image or LatestImage(), state=["live", "Live"])
        page.stream = MjpegStream(page.image, max_viewers=max_viewers, resend_period=0.2)
        options.setdefault("name", "Anna")
        app = create_app(page.stream, describe=lambda: tuple(page.state), **options)
        page.server = WebServer(app, port=port, timeout=timeout).start()
        servers.append(page.server)
        return page

    yield open_page
    for server in servers:
        server.close()


class Life:
    """The focus of a robot with these activities, as ALAutonomousLife tells it."""

    def __init__(self, *installed: str) -> None:
        self.installed, self.focus, self.state = installed, "", "solitary"

    def getState(self) -> str:
        return self.state

    def focusedActivity(self) -> str:
        return self.focus

    def switchFocus(self, activity: str) -> int:
        if activity not in self.installed:
            raise RuntimeError(f"activity '{activity}' is not installed")
        if self.state == "disabled":
            raise RuntimeError("no activity can be in focus")
        self.focus = activity
        return 0

    def stopFocus(self) -> None:
        self.focus = ""


@pytest.fixture
def add_life(naoqi) -> Callable[..., Life]:
    """Give the robot autonomous life with these activities."""

    def add_life(*installed: str) -> Life:
        life = Life(*installed)
        naoqi.register("ALAutonomousLife", life)
        return life

    return add_life
