"""Pictures for ALVideoDevice's subscribers: equal subscriptions share a rendered feed, and unused feeds are closed.

A feed is rendered only while somebody requests its pictures: two seconds after the last request it is closed, and the
next one opens it again, so that a forgotten subscription costs nothing.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np

from pepper_sim.naoqi.video.formats import DEPTH_RANGE, RESOLUTIONS, convert_depth, convert_rgb
from pepper_sim.naoqi.video.parameters import PARAMETERS, Parameter
from pepper_sim.robot import Pepper

log = logging.getLogger(__name__)

IDLE_TIME = 2.0
"""A feed that nobody has read for this long [s] is closed."""
_FIRST_PICTURE_TIMEOUT = 5.0
_LATE = 1.0
"""How much longer than one period a reader waits for a new picture [s]: rendering may be slower than requested."""


@dataclass(frozen=True)
class Camera:
    """A camera of the robot.

    Args:
        index: ALVideoDevice's number.
        name: The robot's and ALVideoDevice's name.
        model: ALVideoDevice's sensor id.
        kind: "rgb" or "depth".
        resolutions: Ids it can deliver.
        spaces: Colour space id -> layers.
        max_fps: [1/s]
        slow: Resolution id -> highest rate, where it is lower [1/s].
        fovx, fovy: Field of view [rad], of one eye.
        views: How many pictures it delivers side by side: 2 for the left and right eye.
        parameters: Parameter id -> its range.
        depth_range: Of a depth camera: nearest and farthest [m].
    """

    index: int
    name: str
    model: int
    kind: str
    resolutions: tuple[int, ...]
    spaces: Mapping[int, int] = field(hash=False)
    max_fps: int
    fovx: float
    fovy: float
    views: int = 1
    parameters: Mapping[int, Parameter] = field(default_factory=lambda: PARAMETERS, hash=False)
    depth_range: tuple[float, float] = DEPTH_RANGE
    slow: Mapping[int, int] = field(default_factory=dict, hash=False)

    def fastest(self, resolution: int) -> int:
        """Return the highest rate at a resolution [1/s]."""
        return self.slow.get(resolution, self.max_fps)


@dataclass(frozen=True)
class ConvertedImage:
    """A converted picture: contiguous bytes, and the time at which it was taken [s since 1970]."""

    data: np.ndarray
    stamp: float


@dataclass
class Cursor:
    """The last picture that a reader received."""

    feed: Any = None
    sequence: int = 0


@dataclass
class _Shared:
    """One feed and the conversions of its newest picture."""

    feed: Any
    used: float
    lock: threading.Lock = field(default_factory=threading.Lock)
    sequence: int = 0
    converted: dict[int, np.ndarray] = field(default_factory=dict)


Key = tuple[str, int, int, bool, bool]
"""Camera name, resolution id, pictures per second, flipped left to right, upside down."""


class Streams:
    """Feeds of the robot's cameras, shared by equal subscriptions."""

    def __init__(self, robot: Pepper) -> None:
        self._robot = robot
        self._lock = threading.Lock()
        self._shared: dict[Key, _Shared] = {}

    def read(self, camera: Camera, key: Key, space: int, cursor: Cursor) -> ConvertedImage | None:
        """Wait for a picture newer than the reader's last one and convert it, once for all readers of this key.

        Args:
            cursor: The reader's own; updated to the picture that is returned.
        Returns:
            None when no picture came in time.
        Raises:
            ValueError, RuntimeError: The camera cannot be rendered.
        """
        shared = self._open(camera, key)
        image, period = shared.feed.image, 1.0 / key[2]
        newest = image.peek()
        after = cursor.sequence if cursor.feed is shared.feed else 0
        if newest is not None and after == 0 and image.age() > period:
            after = newest.sequence
        picture = image.wait_newer(after, _FIRST_PICTURE_TIMEOUT if newest is None else period + _LATE)
        shared.used = time.monotonic()
        if picture is None:
            return None
        cursor.feed, cursor.sequence = shared.feed, picture.sequence
        return ConvertedImage(self._convert(shared, camera, key, picture, space), picture.stamp)

    def close_idle(self, idle_time: float = IDLE_TIME) -> None:
        """Close the feeds that nobody has read for `idle_time` seconds."""
        limit = time.monotonic() - idle_time
        with self._lock:
            idle = [key for key, shared in self._shared.items() if shared.used < limit]
            closing = [self._shared.pop(key) for key in idle]
        for shared in closing:
            shared.feed.close()

    def close(self) -> None:
        self.close_idle(idle_time=-1.0)

    def _open(self, camera: Camera, key: Key) -> _Shared:
        with self._lock:
            shared = self._shared.get(key)
            if shared is None:
                width, height = drawn_size(key[1], camera.views)
                feed = self._robot.subscribe_camera(camera.name, width, height, float(key[2]), camera.kind)
                shared = self._shared[key] = _Shared(feed, time.monotonic())
            shared.used = time.monotonic()
            return shared

    def _convert(self, shared: _Shared, camera: Camera, key: Key, picture: Any, space: int) -> np.ndarray:
        with shared.lock:
            if picture.sequence > shared.sequence:
                shared.sequence, shared.converted = picture.sequence, {}
            data = shared.converted.get(space) if picture.sequence == shared.sequence else None
            if data is None:
                data = convert(_oriented(picture.content, camera, key), camera, space)
                if picture.sequence == shared.sequence:
                    shared.converted[space] = data
            return data


def drawn_size(resolution: int, views: int = 1) -> tuple[int, int]:
    """Return the size at which a resolution of so many views is rendered [px]; the largest is rendered at half its size
    and enlarged."""
    width, height = RESOLUTIONS[resolution]
    return (width // 2, height // 2) if width // views > 1280 else (width, height)


def _oriented(pixels: np.ndarray, camera: Camera, key: Key) -> np.ndarray:
    size = RESOLUTIONS[key[1]]
    if size != drawn_size(key[1], camera.views):
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_LINEAR)
    if key[3] or key[4]:
        views = np.split(pixels, camera.views, axis=1)  # each eye's picture is flipped where it is
        pixels = np.hstack([cv2.flip(view, -1 if key[3] and key[4] else int(key[3])) for view in views])
    return pixels


def convert(pixels: np.ndarray, camera: Camera, space: int) -> np.ndarray:
    """Convert a camera's picture into one of its colour spaces."""
    if camera.kind == "depth":
        return convert_depth(pixels, space, camera.fovy, camera.depth_range)
    return convert_rgb(pixels, space)
