"""A camera that gives nothing more: nobody is shown its last picture as a new one, whoever keeps it."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
import time
from collections.abc import Callable, Iterator

import aiortc.rtcrtpreceiver
import numpy as np
import pytest
from rto_bringup.onboard.camera_server import CameraServer, serve
from rto_bringup.onboard.picture_sources import CameraLost, PictureSource
from rto_node.webrtc_camera import WebrtcCamera

from telepresence.video.images import LatestImage
from telepresence.video.webrtc import release_early

RATE = 15.0
"""[pictures/s]"""
AT_ONCE = 1.0
"""[s] to the first picture of a camera that works, connecting included."""
TRIES = 4
"""The best of so many, as other programs hold up those of a busy machine."""


def planes(level: int) -> np.ndarray:
    return np.full((180, 160), level, np.uint8)


class Camera:
    """Gives pictures while it is plugged in; `frozen` it neither gives any nor fails, as /cam0 may."""

    def __init__(self) -> None:
        self.plugged, self.frozen = threading.Event(), threading.Event()
        self.plugged.set()

    def __call__(self) -> Iterator[np.ndarray]:
        level, tick = 0, threading.Event()
        while self.plugged.is_set():
            if not self.frozen.is_set():
                level = (level + 5) % 200
                yield planes(level)
            tick.wait(1.0 / RATE)
        raise CameraLost("unplugged")


class Keeper:
    """Shows whoever comes the last picture of a dead camera, as a sender does that is older than this receiver."""

    problem = ""

    def __init__(self) -> None:
        self.image = LatestImage()

    def watch(self) -> None:
        self.image.put(planes(100))

    def leave(self) -> None:
        pass


@contextlib.contextmanager
def receiver_of(source: PictureSource | Keeper) -> Iterator[WebrtcCamera]:
    """A sender of these pictures, and its receiver."""
    told: queue.Queue = queue.Queue()

    async def send() -> None:
        loop, task = asyncio.get_running_loop(), asyncio.current_task()
        await serve(CameraServer(source), "127.0.0.1", 0, lambda url: told.put((url, loop, task)))

    def run() -> None:
        with contextlib.suppress(asyncio.CancelledError):
            asyncio.run(send())

    thread = threading.Thread(target=run, name="sender")
    thread.start()
    url, loop, task = told.get(timeout=20.0)
    camera = WebrtcCamera(url)
    try:
        yield camera
    finally:
        camera.close()
        loop.call_soon_threadsafe(task.cancel)
        thread.join(10.0)


@pytest.fixture(autouse=True)
def as_in_the_node(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are handed out at once: aiortc itself would keep the last one of a dead camera for ever."""
    monkeypatch.setattr(aiortc.rtcrtpreceiver, "JitterBuffer", aiortc.rtcrtpreceiver.JitterBuffer)
    assert release_early()


@pytest.fixture
def camera() -> Camera:
    return Camera()


@pytest.fixture
def source(camera: Camera) -> Iterator[PictureSource]:
    made = PictureSource("camera", camera)
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["unplugged", "frozen"])
def test_a_dead_camera_shows_nothing_until_it_lives_again(
    fault: str, camera: Camera, source: PictureSource, wait_until: Callable
) -> None:
    with receiver_of(source) as receiver:
        receiver.want(True)
        wait_until(lambda: receiver.received > 5, "pictures come")
        camera.plugged.clear() if fault == "unplugged" else camera.frozen.set()
        wait_until(lambda: receiver.problem, "the receiver misses them")
        dials, sequence, got = receiver.connections, receiver.image.peek().sequence, []
        while receiver.connections < dials + 3:
            picture = receiver.image.wait_newer(sequence, 0.2)
            if picture is not None:
                sequence = picture.sequence
                got.append(round(time.time() - picture.stamp, 3))
            assert receiver.problem, "it says that there is no picture"
        assert got == [], "pictures of a dead camera, by the age that they are given"
        camera.plugged.set()
        camera.frozen.clear()
        wait_until(lambda: not receiver.problem, "and live again")


@pytest.mark.slow
def test_a_camera_that_works_is_seen_at_once(source: PictureSource, wait_until: Callable) -> None:
    with receiver_of(source) as receiver:
        tries: list[float] = []  # s
        while not any(seconds < AT_ONCE for seconds in tries):
            assert len(tries) < TRIES, f"the first picture comes after {tries} s"
            began, before = time.monotonic(), receiver.received
            receiver.want(True)
            wait_until(lambda before=before: receiver.received > before, "a picture")
            tries.append(time.monotonic() - began)
            receiver.want(False)
            wait_until(lambda: source.image.peek() is None, "the camera is let go, and its picture with it")


@pytest.mark.slow
def test_the_first_picture_of_a_connection_may_be_old(wait_until: Callable) -> None:
    with receiver_of(Keeper()) as receiver:
        receiver.want(True)
        wait_until(lambda: receiver.connections > 2, "nothing new comes")
        assert receiver.received == 0 and receiver.image.peek() is None and receiver.problem


def test_a_lost_camera_takes_its_picture_with_it(camera: Camera, source: PictureSource, wait_until: Callable) -> None:
    source.watch()
    wait_until(source.image.peek, "a picture")
    camera.plugged.clear()
    wait_until(lambda: source.problem, "the camera is lost")
    assert source.image.peek() is None


def test_a_camera_that_was_let_go_keeps_no_picture(source: PictureSource, wait_until: Callable) -> None:
    source.watch()
    wait_until(source.image.peek, "a picture")
    source.leave()
    wait_until(lambda: source.image.peek() is None, "it is forgotten")
