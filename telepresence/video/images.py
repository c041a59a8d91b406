"""The newest picture and its age, and sensor_msgs/Image to and from arrays.

Neither ROS nor OpenCV is imported. Messages are read and written by field name, because Debian's `cv_bridge` does not
load with NumPy 2.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from telepresence.video.jpeg_header import MAX_PIXELS

ENCODINGS: dict[str, tuple[str, int]] = {
    "rgb8": ("u1", 3),
    "bgr8": ("u1", 3),
    "rgba8": ("u1", 4),
    "bgra8": ("u1", 4),
    "mono8": ("u1", 1),
    "mono16": ("u2", 1),
    "16UC1": ("u2", 1),
    "32FC1": ("f4", 1),
}
"""sensor_msgs/Image encoding -> (NumPy type without byte order, channels)."""


@dataclass(frozen=True)
class Picture:
    """One picture.

    Args:
        content: What its writer makes: an array of pixels, a JPEG file, or a message.
        stamp: When it was taken [s since 1970].
        sequence: Counts from 1.
    """

    content: Any
    stamp: float
    sequence: int


class LatestImage:
    """Holds the newest picture only, so that no reader can fall behind. One or more writers, any number of readers."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._picture: Picture | None = None
        self._count = 0
        self._arrival = 0.0
        self._listeners: list[Callable[[], None]] = []

    def put(self, content: Any, stamp: float | None = None) -> None:
        """Replace the picture. `stamp` is when it was taken [s since 1970]; default now."""
        with self._changed:
            self._count += 1
            self._picture = Picture(content, time.time() if stamp is None else stamp, self._count)
            self._arrival = time.monotonic()
            self._changed.notify_all()
            listeners = tuple(self._listeners)
        for listener in listeners:
            listener()

    def forget(self) -> None:
        """Have no picture until the next one is put; numbers go on."""
        with self._changed:
            self._picture = None

    def peek(self) -> Picture | None:
        """Return the newest picture, however old; None before the first and when it was forgotten."""
        return self._picture

    def age(self) -> float:
        """Return the seconds since the newest picture arrived here (monotonic clock); infinity if there is none."""
        with self._changed:
            return time.monotonic() - self._arrival if self._picture else float("inf")

    def begin(self, oldest: float) -> int:
        """Return the number after which pictures are news to a reader that begins now: that of a newest picture that
        arrived here, or was taken, more than `oldest` seconds ago, else 0."""
        with self._changed:
            picture = self._picture
            if picture is None:
                return 0
            old = max(time.monotonic() - self._arrival, time.time() - picture.stamp) > oldest
            return picture.sequence if old else 0

    def wait_newer(self, sequence: int, timeout: float) -> Picture | None:
        """Wait up to `timeout` seconds for a picture after number `sequence` (0: any); None when none came."""
        with self._changed:
            self._changed.wait_for(lambda: self._picture is not None and self._picture.sequence > sequence, timeout)
            picture = self._picture
            return picture if picture is not None and picture.sequence > sequence else None

    def add_listener(self, listener: Callable[[], None]) -> None:
        """Call `listener()` on the writer's thread after every put. It must return at once."""
        with self._changed:
            self._listeners.append(listener)

    def remove_listener(self, listener: Callable[[], None]) -> None:
        with self._changed:
            self._listeners.remove(listener)


def fill_image_message(message: Any, pixels: np.ndarray, encoding: str) -> Any:
    """Write `pixels`, shape (height, width[, channels]), into a sensor_msgs/Image and return it; header untouched.

    Raises:
        ValueError: The encoding is unknown, or shape or type do not fit it.
    """
    kind, channels = _layout(encoding)
    if pixels.dtype != np.dtype(kind):
        raise ValueError(f"encoding {encoding} holds {np.dtype(kind)}, the array holds {pixels.dtype}")
    found = pixels.shape[2] if pixels.ndim == 3 else 1
    if pixels.ndim not in (2, 3) or found != channels:
        raise ValueError(f"encoding {encoding} needs {channels} channel(s), the array has shape {pixels.shape}")
    message.height, message.width = int(pixels.shape[0]), int(pixels.shape[1])
    message.encoding = encoding
    message.is_bigendian = 0
    message.step = message.width * channels * np.dtype(kind).itemsize
    message.data = np.ascontiguousarray(pixels).tobytes()
    return message


def read_image_message(message: Any) -> np.ndarray:
    """Return the pixels of a sensor_msgs/Image: (height, width[, channels]), read-only, padding removed.

    Raises:
        ValueError: Unknown encoding, no pixels or more than `MAX_PIXELS`, or fewer bytes than height and step promise.
    """
    kind, channels = _layout(message.encoding)
    if not 0 < message.width * message.height <= MAX_PIXELS:
        raise ValueError(f"a picture of {message.width}x{message.height} pixels; 1 to {MAX_PIXELS} are shown")
    dtype = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    row = message.width * channels * dtype.itemsize
    if message.step < row or len(message.data) < message.step * message.height:
        raise ValueError(
            f"{message.width}x{message.height} {message.encoding} needs step >= {row} and "
            f"{message.step * message.height} bytes; got step {message.step} and {len(message.data)} bytes"
        )
    rows = np.frombuffer(message.data, np.uint8, message.step * message.height).reshape(message.height, message.step)
    pixels = np.ascontiguousarray(rows[:, :row]) if message.step != row else rows
    pixels = pixels.view(dtype).reshape(message.height, message.width, channels)
    return pixels if channels > 1 else pixels[:, :, 0]


def _layout(encoding: str) -> tuple[str, int]:
    try:
        return ENCODINGS[encoding]
    except KeyError:
        raise ValueError(f"unknown image encoding {encoding[:20]!r}; known: {', '.join(ENCODINGS)}") from None
