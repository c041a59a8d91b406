"""Where pictures come from: a camera, a file, an address on the network, or a test card.

A source is opened by `open_source`, read until it raises `SourceError`, and closed. The error's text is for people: it
is what the test picture says.
"""

from __future__ import annotations

import logging
import os
import pathlib
import time
from typing import Protocol

import numpy as np

# Read by OpenCV when it first needs them: a camera that stops delivering blocks for a second instead of ten, and FFmpeg
# does not write on the terminal at every attempt to connect.
os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "1")
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

import cv2

from telepresence_1.jpeg import Jpeg, completed
from telepresence_1.placeholder_images import draw_test_card

cv2.setLogLevel(2)  # errors only

log = logging.getLogger(__name__)

NETWORK_TIMEOUT = 3000  # ms for connecting, and for the next picture
MOTION_JPEG = cv2.VideoWriter.fourcc(*"MJPG")
MOST_DAMAGED = 30
"""Damaged pictures in a row after which a camera counts as lost."""
_URL_SCHEMES = ("http://", "https://", "rtsp://", "rtmp://", "udp://", "tcp://")


class SourceError(Exception):
    """The source cannot be opened or has ended; `title` in two or three words, the text in a sentence."""

    def __init__(self, title: str, text: str) -> None:
        super().__init__(text)
        self.title = title


class Source(Protocol):
    def read(self) -> np.ndarray | Jpeg:
        """The next picture, waited for: (height, width, 3) uint8 BGR, or as the camera has encoded it.

        Raises:
            SourceError: There is none any more.
        """

    def close(self) -> None: ...


def open_source(source: str, width: int, height: int, rate: float) -> Source:
    """Open what `source` names.

    Args:
        source: "test"; a camera as number ("0") or device ("/dev/video0"); an http, https, rtsp, rtmp, udp or tcp
            address; or the path of a video or picture, which is repeated for ever.
        width, height, rate: What a camera is asked for [pixel, pixel, 1/s], and the test card's size and rate.
    Raises:
        SourceError: It cannot be opened.
    """
    if source == "test":
        return Card(width, height, rate)
    if source.isdecimal() or source.startswith("/dev/"):
        device = f"/dev/video{source}" if source.isdecimal() else source
        return Device(device, width, height, rate)
    if source.lower().startswith(_URL_SCHEMES):
        return Url(source, rate)
    return File(source, rate)


class Pace:
    """Waits so that pictures leave at a steady rate; after a pause it does not catch up."""

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._next = time.monotonic()

    def wait(self) -> None:
        now = time.monotonic()
        if now < self._next:
            time.sleep(self._next - now)
        self._next = max(self._next, now - self._period) + self._period


class Card:
    """A picture that moves, for want of a camera or of a face."""

    def __init__(self, width: int, height: int, rate: float) -> None:
        self._size = (width, height)
        self._pace = Pace(rate)

    def read(self) -> np.ndarray:
        self._pace.wait()
        return draw_test_card(*self._size, time.time())

    def close(self) -> None:
        """Nothing is held open."""


class Device:
    """A camera of this machine, by Video4Linux."""

    def __init__(self, device: str, width: int, height: int, rate: float) -> None:
        self._device = device
        if not os.path.exists(device):
            raise SourceError("No camera", f"There is no camera at {device}. Plug one in, and it will be found.")
        if not os.access(device, os.R_OK | os.W_OK):
            raise SourceError("No access", f"This user may not open {device}: it has to be in the group video.")
        self._capture = cv2.VideoCapture(device, cv2.CAP_V4L2)
        if not self._capture.isOpened():
            raise SourceError("Camera busy", f"{device} cannot be opened. Another program may be using it.")
        for key, value in (
            (cv2.CAP_PROP_FOURCC, MOTION_JPEG),  # a camera that cannot keeps what it has
            (cv2.CAP_PROP_FRAME_WIDTH, width),
            (cv2.CAP_PROP_FRAME_HEIGHT, height),
            (cv2.CAP_PROP_FPS, rate),
            (cv2.CAP_PROP_BUFFERSIZE, 1),  # further pictures in the driver would only be old
        ):
            self._capture.set(key, value)
        self._encoded = Encoded(self._capture, cv2.CAP_PROP_CONVERT_RGB, 0)

    def read(self) -> np.ndarray | Jpeg:
        picture = self._encoded.read()
        if picture is None:  # for ever from now on, although isOpened() stays true
            raise SourceError("Camera lost", f"{self._device} was unplugged or has stopped delivering pictures.")
        return picture

    def close(self) -> None:
        self._capture.release()


class Url:
    """A stream from the network. One with an end (a video file on a server) is played at its own speed."""

    def __init__(self, url: str, rate: float) -> None:
        self._url = url
        limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, NETWORK_TIMEOUT, cv2.CAP_PROP_READ_TIMEOUT_MSEC, NETWORK_TIMEOUT]
        self._capture = cv2.VideoCapture(url, cv2.CAP_FFMPEG, limits)
        if not self._capture.isOpened():
            raise SourceError("No stream", f"{url} does not answer with a video.")
        finite = self._capture.get(cv2.CAP_PROP_FRAME_COUNT) > 0
        self._pace = Pace(_rate_of(self._capture, rate)) if finite else None
        self._encoded = Encoded(self._capture, cv2.CAP_PROP_FORMAT, -1)

    def read(self) -> np.ndarray | Jpeg:
        if self._pace:
            self._pace.wait()
        picture = self._encoded.read()
        if picture is None:
            raise SourceError("Stream lost", f"{self._url} has stopped delivering pictures.")
        return picture

    def close(self) -> None:
        self._capture.release()


class File:
    """A video, again and again, or a still picture."""

    def __init__(self, path: str, rate: float) -> None:
        self._path = path
        if not pathlib.Path(path).is_file():
            raise SourceError("No such file", f"{path} does not exist.")
        self._still: np.ndarray | None = cv2.imread(path)
        self._capture: cv2.VideoCapture | None = None
        if self._still is None:
            self._capture = cv2.VideoCapture(path, cv2.CAP_FFMPEG)
            if not self._capture.isOpened():
                raise SourceError("Unknown format", f"{path} is neither a video nor a picture that OpenCV can read.")
            rate = _rate_of(self._capture, rate)
            self._encoded = Encoded(self._capture, cv2.CAP_PROP_FORMAT, -1)
        self._pace = Pace(rate)

    def read(self) -> np.ndarray | Jpeg:
        self._pace.wait()
        if not pathlib.Path(self._path).is_file():  # what is open could be read for ever
            raise SourceError("File removed", f"{self._path} was removed. It is shown again as soon as it is back.")
        if self._capture is None:
            assert self._still is not None, "a file is a video or a still picture"
            return self._still.copy()
        picture = self._encoded.read()
        if picture is None:
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, 0)
            picture = self._encoded.read()
        if picture is None:
            raise SourceError("Damaged file", f"{self._path} holds no picture that can be read.")
        return picture

    def close(self) -> None:
        if self._capture is not None:
            self._capture.release()


class Encoded:
    """Reads a capture; one that delivers motion JPEG is read without decoding it, damaged pictures left out.

    Args:
        capture: Open, its format chosen.
        key, value: The setting that makes OpenCV hand out what it got (which one depends on its backend).
    """

    def __init__(self, capture: cv2.VideoCapture, key: int, value: float) -> None:
        self._capture = capture
        encoded = int(capture.get(cv2.CAP_PROP_FOURCC)) == MOTION_JPEG
        self._raw = encoded and capture.set(key, value)

    def read(self) -> np.ndarray | Jpeg | None:
        """The next picture, None when there is none."""
        for _ in range(MOST_DAMAGED):
            picture = _read(self._capture)
            if picture is None or not self._raw:
                return picture
            whole = completed(picture.tobytes())
            if whole is not None:
                return whole
        return None


def _read(capture: cv2.VideoCapture) -> np.ndarray | None:
    """The next picture, None when there is none."""
    try:
        delivered, picture = capture.read()
    except cv2.error as error:  # a driver that contradicts itself
        log.warning("OpenCV cannot read the camera: %s", error)
        return None
    return picture if delivered else None


def _rate_of(capture: cv2.VideoCapture, default: float) -> float:
    rate = capture.get(cv2.CAP_PROP_FPS)
    return rate if 1.0 <= rate <= 120.0 else default
