"""The robot's transforms, in a buffer of tf2. Window and page subscribe."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import genpy
import numpy as np
import tf2_ros
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from telepresence.security.outside_text import LONGEST_NAME, clean

HISTORY = 10.0
"""[s] for which transforms are stored."""
LARGEST_LAG = 0.3
"""[s] by which the newest transform may be older than a picture: meanwhile a robot moves about 0.1 m."""


MOST_FRAMES = 500
"""Frames of a robot; Pepper has about 80."""


class Subscriber(Protocol):
    def unregister(self) -> None: ...


class Transforms:
    """The transforms of one robot. May be used from any thread; only `listen` waits for the master.

    Two robots on one master both have a frame base_link, so one of them has its transforms in its namespace. As soon as
    one arrives there, those on /tf are another robot's.

    Args:
        namespace: The robot's.
        subscribe: Subscribes to a topic: its name, the class of its messages, a callback, and a second argument for the
            callback.
    """

    def __init__(self, namespace: str, subscribe: Callable[[str, type, Callable, str], Subscriber]) -> None:
        self._namespace = namespace.rstrip("/")
        self._subscribe = subscribe
        self._buffer: tf2_ros.Buffer | None = None
        self._has_own = False
        self._subscribers: list[Subscriber] = []
        self._frames: set[str] = set()
        self._newest = 0.0

    def listen(self, wanted: bool) -> None:
        """Receive transforms from now on, or no longer; to be called when the graph has been joined."""
        if wanted == bool(self._subscribers):
            return
        self._buffer, self._has_own = _new_buffer(), False
        self._frames.clear()
        while self._subscribers:
            self._subscribers.pop().unregister()
        for topic, method in (("tf", "set_transform"), ("tf_static", "set_transform_static")) if wanted else ():
            self._subscribers.append(self._subscribe(f"/{topic}", TFMessage, self._on_common, method))
            if self._namespace:
                own = f"{self._namespace}/{topic}"
                self._subscribers.append(self._subscribe(own, TFMessage, self._on_own, method))

    def _on_common(self, message: TFMessage, method: str) -> None:
        if not self._has_own:
            self._store(message, method)

    def _on_own(self, message: TFMessage, method: str) -> None:
        if not self._has_own:
            self._has_own = True
            self._buffer = _new_buffer()
            self._frames.clear()
        self._store(message, method)

    def _store(self, message: TFMessage, method: str) -> None:
        for transform in message.transforms:
            self._note_time(transform.header.stamp.to_sec(), method)
            # tf2 prints a line for each transform that is not finite, and keeps every frame for ever.
            if _finite(transform) and self._room_for(transform.child_frame_id):
                getattr(self._buffer, method)(transform, "transforms")

    def _note_time(self, stamp: float, method: str) -> None:
        """Forget the moving transforms when the clock was set back: tf2 takes none that are older than those it has."""
        if method != "set_transform" or not math.isfinite(stamp):
            return
        if stamp < self._newest - HISTORY and self._buffer is not None:
            self._buffer.clear()
            self._newest = stamp
        self._newest = max(self._newest, stamp)

    def _room_for(self, frame: str) -> bool:
        if len(self._frames) < MOST_FRAMES and len(frame) <= LONGEST_NAME:
            self._frames.add(frame)
        return frame in self._frames

    def place_of(self, frame: str, seen_from: str, stamp: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose of `frame` in `seen_from` at `stamp` [s since 1970].

        Returns:
            (3, 3) rotation, whose columns are the frame's axes, and (3,) position [m].
        Raises:
            LookupError: It is unknown; the message says why.
        """
        buffer = self._buffer
        if buffer is None:
            raise LookupError("no transforms are received yet")
        try:
            found = _lookup(buffer, frame, seen_from, stamp)
        except tf2_ros.TransformException as error:
            raise LookupError(clean(error)) from None
        q, t = found.transform.rotation, found.transform.translation
        return _rotation(q.x, q.y, q.z, q.w), np.array((t.x, t.y, t.z))


def _lookup(buffer: tf2_ros.Buffer, frame: str, seen_from: str, stamp: float) -> TransformStamped:
    """Return the transform at `stamp`, or the newest one if that is at most `LARGEST_LAG` older."""
    try:
        return buffer.lookup_transform(seen_from, frame, genpy.Time.from_sec(stamp))
    except tf2_ros.ExtrapolationException:
        newest = buffer.lookup_transform(seen_from, frame, genpy.Time())
        if abs(newest.header.stamp.to_sec() - stamp) > LARGEST_LAG:
            raise
        return newest


def _finite(transform: TransformStamped) -> bool:
    q, t = transform.transform.rotation, transform.transform.translation
    return all(map(math.isfinite, (q.x, q.y, q.z, q.w, t.x, t.y, t.z)))


def _new_buffer() -> tf2_ros.Buffer:
    return tf2_ros.Buffer(genpy.Duration(HISTORY), debug=False)


def _rotation(x: float, y: float, z: float, w: float) -> np.ndarray:
    return np.array((
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    ))  # fmt: skip
