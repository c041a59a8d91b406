"""Where the robot's pictures come from: its web server's /cam0, a V4L2 device, or a test picture.

A source works on a thread of its own while somebody watches, keeps the newest picture only, and tries again when the
camera is lost. It keeps none of a camera that is lost or let go: whoever came next would see it as new.
"""

from __future__ import annotations

import http.client
import logging
import math
import threading
import time
from collections.abc import Callable, Generator

import av
import numpy as np
from rto_node.client import RobotinoClient, RobotinoError

from telepresence.start_patience import StartPatience
from telepresence.video.images import LatestImage
from telepresence.video.jpeg_header import check_jpeg
from telepresence.video.webrtc import planes_of

log = logging.getLogger(__name__)

SHORTEST_BACK_OFF, LONGEST_BACK_OFF = 0.1, 0.5
"""Seconds until a lost camera is tried again; doubled from one failure to the next until there is a picture."""
NO_NEWS_PERIOD = 0.01
"""Seconds until /cam0 is asked again when it has no new picture."""
NO_NEWS_TIMEOUT = 4.0
"""Seconds without a picture after which /cam0 counts as lost; a camera takes a moment to wake up."""

Pictures = Generator[np.ndarray, None, None]
"""Planes of yuv420p, shape (height * 3 / 2, width) uint8, each as soon as it was taken."""


class CameraLost(RuntimeError):
    """The camera gives no picture; the text says why and what to do."""


class PictureSource:
    """Keeps the newest picture of a camera, which is open while anybody watches.

    Args:
        name: For the log.
        open_camera: Gives its pictures; raises CameraLost. Its `close` releases the camera.
        patience: For a camera behind a program that may have been started together with this one.
    """

    def __init__(self, name: str, open_camera: Callable[[], Pictures], patience: StartPatience | None = None) -> None:
        self.image = LatestImage()
        self.problem = ""
        """Why there is no picture; empty while there is one."""
        self._name, self._complained = name, ""
        self._open, self._patience = open_camera, patience
        self._back_off = SHORTEST_BACK_OFF
        self._watchers = 0
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._thread.start()

    def watch(self) -> None:
        """One more watcher: the camera is opened for the first."""
        with self._changed:
            self._watchers += 1
            self._changed.notify()

    def leave(self) -> None:
        """One watcher less: the camera is let go after the last."""
        with self._changed:
            self._watchers -= 1

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=3.0)

    @property
    def _wanted(self) -> bool:
        return self._watchers > 0 and not self._closed

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._wanted or self._closed)
                if self._closed:
                    return
            try:
                self._take()
                continue
            except CameraLost as error:
                self._complain(str(error))
            except Exception as error:  # whatever a driver of a camera raises: it is tried again
                log.exception("%s failed", self._name)
                self.problem = repr(error)
            with self._changed:
                self._changed.wait_for(lambda: self._closed, self._back_off)
            self._back_off = min(LONGEST_BACK_OFF, 2.0 * self._back_off)

    def _take(self) -> None:
        pictures = self._open()
        try:
            for planes in pictures:
                if not self._wanted:
                    return
                if self.problem:
                    log.info("%s gives pictures again", self._name)
                self.problem, self._complained, self._back_off = "", "", SHORTEST_BACK_OFF
                if self._patience is not None:
                    self._patience.works()
                self.image.put(planes)
        finally:
            self.image.forget()
            pictures.close()

    def _complain(self, problem: str) -> None:
        self.problem = problem
        if problem != self._complained and (self._patience is None or self._patience.over):
            log.error("%s: %s; trying again", self._name, problem)
            self._complained = problem


def open_source(text: str, rate: float, size: tuple[int, int]) -> PictureSource:
    """The source that a person names on the command line.

    Args:
        text: "test", the address of the robot's web server (host, host:port, http://host:port), or a device (/dev/...).
        rate: Pictures per second, at most.
        size: (width, height) [pixel]; a robot's web server has its own.
    Raises:
        ValueError: The rate or the address is invalid.
    """
    if not (math.isfinite(rate) and 0.0 < rate <= 120.0):
        raise ValueError(f"a camera rate of {rate} is invalid; give a number of pictures per second up to 120")
    if text == "test":
        return PictureSource("test picture", lambda: synthetic_pictures(rate, size))
    if text.startswith("/"):
        return PictureSource(text, lambda: device_pictures(text, rate, size))
    RobotinoClient(text)  # raises on a bad address
    return PictureSource(f"the camera of {text}", lambda: web_pictures(text, rate), StartPatience())


def web_pictures(address: str, rate: float) -> Pictures:
    """Read /cam0 of the robot's web server, which answers 500 while its camera wakes up or has no newer picture."""
    client = RobotinoClient(address, timeout=2.0)
    decoder = av.VideoCodecContext.create("mjpeg", "r")
    due = newest = time.monotonic()
    try:
        while True:
            try:
                data = client.picture()
            except (RobotinoError, http.client.HTTPException) as error:
                raise CameraLost(str(error)) from None
            if not data:
                if time.monotonic() - newest > NO_NEWS_TIMEOUT:
                    raise CameraLost(f"Robotino at {client.address} has no picture: is its camera plugged in?")
                time.sleep(NO_NEWS_PERIOD)
                continue
            newest = time.monotonic()
            yield planes_of(_decode(decoder, data))
            due = max(due + 1.0 / rate, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))
    finally:
        client.close()


def _decode(decoder: av.VideoCodecContext, jpeg: bytes) -> av.VideoFrame:
    try:
        check_jpeg(jpeg)
        frames = decoder.decode(av.Packet(jpeg))
    except (ValueError, av.FFmpegError) as error:
        raise CameraLost(f"a picture is not a JPEG: {error}") from None
    if not frames:
        raise CameraLost(f"{len(jpeg)} bytes are not a whole JPEG")
    return frames[0]


def device_pictures(path: str, rate: float, size: tuple[int, int]) -> Pictures:
    """Read a Video4Linux camera, for example /dev/video0."""
    options = {"video_size": f"{size[0]}x{size[1]}", "framerate": f"{rate:g}"}
    try:
        container = av.open(path, format="v4l2", options=options, timeout=(5.0, 2.0))
    except (av.FFmpegError, OSError) as error:
        raise CameraLost(
            f"{path} does not open: {error}. Is it plugged in and nobody else's? Robotino's own camera program lets "
            "it go ten seconds after the last question for /cam0"
        ) from None
    with container:
        try:
            for frame in container.decode(video=0):
                yield planes_of(frame)
        except (av.FFmpegError, OSError) as error:
            raise CameraLost(f"{path} was lost: {error}") from None
    raise CameraLost(f"{path} gives no more pictures")


def synthetic_pictures(rate: float, size: tuple[int, int]) -> Pictures:
    """A ball that rolls over a slowly moving pattern: for links and clocks, not for people."""
    width, height = size
    columns = np.arange(width + 256, dtype=np.float32)
    rows = np.arange(height, dtype=np.float32)[:, None]
    pattern = 120 + 50 * np.sin(columns / 19) * np.cos(rows / 23) + 30 * np.sin((columns + rows) / 41)
    pattern = (pattern + np.random.default_rng(0).normal(0, 6, pattern.shape)).clip(16, 235).astype(np.uint8)
    y, x = np.ogrid[:height, :width]
    begin = due = time.monotonic()
    while True:
        elapsed = time.monotonic() - begin
        shift = int(elapsed * 40) % 256
        planes = np.full((height * 3 // 2, width), 128, np.uint8)
        planes[:height] = pattern[:, shift : shift + width]
        across, up = (0.5 + 0.4 * math.sin(elapsed)) * width, (0.4 + 0.2 * math.cos(1.7 * elapsed)) * height
        planes[:height][(x - across) ** 2 + (y - up) ** 2 < (height / 8) ** 2] = 235
        yield planes
        due = max(due + 1.0 / rate, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
