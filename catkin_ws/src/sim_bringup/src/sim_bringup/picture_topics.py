"""Picture topics that cost nothing while nobody subscribes."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import Image

from telepresence.sim.camera import CamerasFailed, Feed
from telepresence.video.images import LatestImage, fill_image_message, read_image_message

PICTURE_TIMEOUT = 0.2
"""Seconds to wait for a picture before looking for readers again."""
SETTLED = 3.0
"""[s] after a reset, by when all pictures from before it have come."""
RETRY_PERIOD = 5.0
"""Seconds until a source that cannot be opened is tried again."""
BUFFER = 1 << 22
"""Bytes of the reading socket; more than one picture, or old ones wait in it."""

OpenSource = Callable[[], AbstractContextManager[Callable[[], LatestImage]]]
"""Renders pictures for as long as somebody subscribes."""

_TO_RGB = {
    "bgr8": cv2.COLOR_BGR2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "mono8": cv2.COLOR_GRAY2RGB,
}


class PictureTopic:
    """Publishes the pictures of a source as rgb8 while somebody reads; a new reader gets the newest at once.

    Args:
        topic: Its name.
        frame: frame_id of the pictures.
        open_source: Opened when the first reader comes, left when the last one is gone.
        rate: At most so many pictures per second [Hz]; None for all.
        first: Publish a dark picture when there never was one, so that readers know that the screen is dark.
    """

    def __init__(
        self, topic: str, frame: str, open_source: OpenSource, *, rate: float | None = None, first: bool = False
    ) -> None:
        self._publisher = rospy.Publisher(topic, Image, queue_size=1)
        self._frame = frame
        self._open_source = open_source
        self._period = 1.0 / rate if rate else 0.0
        self._first = first
        self._not_before, self._reset_at = 0.0, -math.inf
        self._due = 0.0

    def reset(self) -> None:
        """The world starts afresh: pictures from before are not shown any more, and the timer starts now."""
        self._not_before, self._reset_at = time.time(), time.monotonic()
        self._due = 0.0

    def run(self, stop: threading.Event) -> None:
        """Publish until `stop` is set."""
        while not stop.is_set():
            if not self._publisher.get_num_connections():
                stop.wait(PICTURE_TIMEOUT)
                continue
            try:
                with self._open_source() as source:
                    self._serve(source, stop)
            except (CamerasFailed, ValueError) as error:
                rospy.logerr("%s: %s", self._publisher.resolved_name, error)
                stop.wait(RETRY_PERIOD)
            except rospy.ROSException:
                return  # the topic was closed: this node is being shut down

    def _serve(self, source: Callable[[], LatestImage], stop: threading.Event) -> None:
        sequence, readers = 0, 0
        while not stop.is_set():
            before, readers = readers, self._publisher.get_num_connections()
            if not readers:
                return
            image = source()
            picture = image.wait_newer(0 if readers > before else sequence, PICTURE_TIMEOUT)
            if picture is not None:
                sequence = picture.sequence
                if self._first or not self._from_before(picture.stamp, image.age()):
                    self._publish(picture.content, picture.stamp)
                    self._pace(stop)
            elif self._first and readers > before:
                self._publish(np.zeros((400, 640, 3), np.uint8), time.time())

    def _from_before(self, stamp: float, age: float) -> bool:
        """Whether a picture is older than the last reset. Its stamp is a date, and the clock may be set meanwhile:
        it only counts for pictures that came shortly after the reset."""
        arrival = time.monotonic() - age
        return arrival < self._reset_at + SETTLED and (arrival < self._reset_at or stamp < self._not_before)

    def _pace(self, stop: threading.Event) -> None:
        now = time.monotonic()
        self._due = max(self._due, now - self._period) + self._period
        if self._due > now:
            stop.wait(self._due - now)

    def _publish(self, pixels: np.ndarray, stamp: float) -> None:
        message = fill_image_message(Image(), pixels, "rgb8")
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.header.frame_id = self._frame
        self._publisher.publish(message)


def from_cameras(subscribe: Callable[..., Feed], camera: str | None, rate: float) -> OpenSource:
    """Pictures 640x480 drawn for this topic alone; `camera` is left out where the robot has only one."""

    @contextlib.contextmanager
    def opened() -> Iterator[Callable[[], LatestImage]]:
        with subscribe(*([camera] if camera else []), 640, 480, rate) as feed:
            yield lambda: feed.image

    return opened


def from_topic(topic: str, size: tuple[int, int]) -> OpenSource:
    """Pictures that a driver publishes, brought to `size` (width, height) [px] and RGB.

    Raises:
        ValueError: When opened without the name of a topic.
    """

    @contextlib.contextmanager
    def opened() -> Iterator[Callable[[], LatestImage]]:
        if not topic:
            raise ValueError("no driver's picture topic is known: set the parameter ~wires/<robot>/image")
        newest = LatestImage()

        def take(message: Image) -> None:
            try:
                newest.put(_rgb(message, size), message.header.stamp.to_sec())
            except ValueError as error:
                rospy.logwarn_throttle(10.0, f"{topic}: {error}")

        subscriber = rospy.Subscriber(topic, Image, take, queue_size=1, buff_size=BUFFER)
        try:
            yield lambda: newest
        finally:
            subscriber.unregister()

    return opened


def _rgb(message: Image, size: tuple[int, int]) -> np.ndarray:
    pixels = read_image_message(message)
    if message.encoding in _TO_RGB:
        pixels = cv2.cvtColor(pixels, _TO_RGB[message.encoding])
    elif message.encoding != "rgb8":
        raise ValueError(f"pictures in {message.encoding} cannot be shown in colour")
    return pixels if pixels.shape[1::-1] == size else cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
