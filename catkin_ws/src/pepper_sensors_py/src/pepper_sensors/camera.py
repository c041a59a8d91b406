"""Pictures of one robot camera.

Wire (NAOqi 2.8 documentation, ALVideoDevice): `subscribeCamera(name, camera, resolution, colour space, frames/s)`
returns a handle, the name with "_0" or another number behind it, "" when too many are open; `getImageRemote(handle)`
returns None or [width, height, layers, colour space, seconds, microseconds, pixels, camera, left, top, right, bottom
angle (rad)], at the latest after one frame period; `unsubscribe(handle)`. Pictures are pulled one at a time, so none
can queue up on the way.
"""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from naoqi_driver.connection import CallRefused, Connection, RobotError
from naoqi_driver.replies import numbers, sequence

from pepper_sensors.colour import convert, require_known

log = logging.getLogger(__name__)

STEREO = 3
"""Index of the stereo camera, which only head 1.8 has: the pictures of the left and the right eye stand side by side
(NAOqi 2.8 documentation, video_Stereo_pep)."""
CAMERAS = {0: "CameraTop", 1: "CameraBottom", 2: "CameraDepth", STEREO: "CameraStereo"}
"""Index of a camera on Pepper -> its name; frames are named after it."""
LATEST = 2**32 - 1 - 10**6
"""Latest stamp of a picture [s]; a message's header holds a little more."""
MOST_SUBSCRIBERS = 1000
REPLY_TIMEOUT = 1.0
"""Seconds a picture may take beyond one frame period."""


@dataclass(frozen=True)
class CameraPicture:
    """One picture.

    Args:
        pixels: (height, width[, 3]), uint8 or uint16 [mm].
        encoding: As in sensor_msgs/Image.
        stamp: When it was taken, by the robot's clock [s since 1970].
        angles: Of the left, top, right and bottom edge against the optical axis [rad]; left and top are positive.
    """

    pixels: np.ndarray
    encoding: str
    stamp: float
    angles: tuple[float, float, float, float]


def read_reply(reply: Any) -> CameraPicture:
    """The picture in a reply of getImageRemote.

    Raises:
        UnexpectedReply, ValueError: The reply is not such a container, or its parts contradict each other.
    """
    parts = sequence(reply, "a picture")
    if len(parts) < 12:
        raise ValueError(f"a picture has 12 elements, the robot sent {len(parts)}")
    width, height, layers, space = (int(part) for part in numbers(parts[:4], 4, "a picture's size"))
    if not isinstance(parts[6], bytes | bytearray):
        raise ValueError(f"the pixels came as {type(parts[6]).__name__}, not as bytes")
    pixels, encoding = convert(parts[6], width, height, layers, space)
    seconds, microseconds = parts[4:6]
    # Stamps count seconds since 1970; beyond what a message's header can hold there is none.
    if not (_is_count(seconds, LATEST) and _is_count(microseconds, 10**6)):
        raise ValueError("a picture's time is invalid")
    left, top, right, bottom = numbers(parts[8:12], 4, "a picture's angles")
    return CameraPicture(pixels, encoding, seconds + microseconds * 1e-6, (left, top, right, bottom))


def _is_count(value: object, largest: int) -> bool:
    return isinstance(value, int) and 0 <= value <= largest


class Camera:
    """A subscription to one camera, made when the first picture is asked for and repeated after every new link.

    Args:
        connection: The link to the robot.
        name: Ours among the robot's subscribers. What an earlier program of this name left behind is removed.
        source: Index of the camera, see `CAMERAS`.
        resolution, space: NAOqi's ids of resolution and colour space.
        frame_rate: Pictures per second, 1 to 30.

    Raises:
        ValueError: There is no such camera, or no conversion for the colour space.
    """

    def __init__(
        self, connection: Connection, name: str, source: int, resolution: int, space: int, frame_rate: int
    ) -> None:
        if source not in CAMERAS:
            raise ValueError(f"there is no camera {source}; known: {CAMERAS}")
        require_known(space)
        self.period = 1.0 / frame_rate
        self._connection = connection
        self._name = name
        self._settings = (source, resolution, space, frame_rate)
        self._handle: str | None = None
        self._link = 0
        self._last_stamp = -math.inf

    @property
    def frame_id(self) -> str:
        """The camera's optical frame; for the stereo camera that of the left eye, through which depth is seen too."""
        source = self._settings[0]
        return f"{CAMERAS[2 if source == STEREO else source]}_optical_frame"

    @property
    def views(self) -> int:
        """How many pictures of equal width stand side by side in one."""
        return 2 if self._settings[0] == STEREO else 1

    def grab(self) -> CameraPicture | None:
        """The robot's newest picture, or None when it has none that was not grabbed before.

        Raises:
            RobotUnreachable: No link, or no reply in time.
            CallRefused: The robot does not give us the camera.
            ValueError: It sent something that is no picture.
        """
        if self._link != self._connection.connections:
            self._handle = None
        if self._handle is None:
            self._subscribe()
        reply = self._connection.call(
            "ALVideoDevice", "getImageRemote", self._handle, timeout=REPLY_TIMEOUT + self.period
        )
        if reply is None:
            return None
        picture = read_reply(reply)
        if picture.stamp == self._last_stamp:
            return None
        self._last_stamp = picture.stamp
        return picture

    def close(self) -> None:
        """Give the subscription back; nothing happens when the link is gone."""
        handle, self._handle = self._handle, None
        if handle is not None and self._link == self._connection.connections and self._connection.connected:
            try:
                self._connection.call("ALVideoDevice", "unsubscribe", handle)
            except RobotError as error:
                log.warning("could not give the camera back: %s", error)

    def _subscribe(self) -> None:
        link = self._connection.connections
        subscribers = sequence(self._connection.call("ALVideoDevice", "getSubscribers"), "getSubscribers")
        for subscriber in subscribers[:MOST_SUBSCRIBERS]:
            # The robot appends _0, _1, ... to the name.
            stem, mark, number = str(subscriber).rpartition("_") if isinstance(subscriber, str) else ("", "", "")
            if subscriber == self._name or (mark and number.isdigit() and stem == self._name):
                log.info("removing the camera subscription %s that an earlier program left", subscriber)
                self._connection.call("ALVideoDevice", "unsubscribe", subscriber)
        handle = self._connection.call("ALVideoDevice", "subscribeCamera", self._name, *self._settings)
        if not handle or not isinstance(handle, str | int):
            source, resolution, space, _ = self._settings
            raise CallRefused(
                f"the robot gives no handle for camera {source}: too many programs may be subscribed to it, or the "
                f"head has no such camera, or not resolution {resolution} with colour space {space}"
            )
        self._handle = str(handle)
        self._link = link


class RobotClock:
    """Turns the robot's stamps into local time, when the two clocks differ.

    The smallest of the last differences between arrival and stamp belongs to the fastest picture. When it is not
    negative and below `tolerance`, the clocks agree and stamps stay as they are; otherwise this difference is added to
    them.
    """

    CLOCK_SET = 5.0
    """[s] by which the difference changes from one picture to the next only if somebody has set one of the clocks."""

    def __init__(self, tolerance: float = 0.5, memory: int = 100) -> None:
        self.difference = 0.0
        """What is added to a stamp [s]."""
        self._tolerance = tolerance
        self._delays: deque[float] = deque(maxlen=memory)
        self._lock = threading.Lock()

    def to_local(self, stamp: float, arrival: float) -> float:
        """The local time [s] at which a picture stamped `stamp` [s] was taken that arrived at `arrival` [s]."""
        with self._lock:
            if self._delays and abs(arrival - stamp - self._delays[-1]) > self.CLOCK_SET:
                self._delays.clear()
            self._delays.append(arrival - stamp)
            fastest = min(self._delays)
            self.difference = 0.0 if 0.0 <= fastest < self._tolerance else fastest
            return stamp + self.difference
