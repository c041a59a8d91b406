"""Writes a topic of pictures into an MP4 file until it is interrupted:  rosrun avatar_gui record_film TOPIC FILE

A process of its own, so that encoding slows neither the window nor its drivers. TOPIC is sensor_msgs/CompressedImage if
its name ends in /compressed (image_transport), else sensor_msgs/Image. A film needs pictures: without any there is no
file, and the exit code is 3.
"""

from __future__ import annotations

import argparse
import sys
import threading
from pathlib import Path

import numpy as np
import rospy
from sensor_msgs.msg import CompressedImage, Image
from telepresence_ros.single_connections import connect_once
from telepresence_ros.sockets import narrow_sockets

from gui.recording.film import Film
from telepresence.security.outside_text import keep_logs_plain
from telepresence.station import priority
from telepresence.video.displayable import as_bgr
from telepresence.video.images import read_image_message
from telepresence.video.jpeg import decode_jpeg

BUFFER = 1 << 22
"""Bytes of the reading socket; more than one picture, or old ones wait in it."""
NO_PICTURES = 3
"""Exit code when not one came."""


class FilmNode:
    """Films one topic."""

    def __init__(self, topic: str, path: Path) -> None:
        self._film = Film(path)
        self._lock = threading.Lock()
        self.problem = ""
        """Why the film ended before its time."""
        kind = CompressedImage if topic.endswith("/compressed") else Image
        self._subscriber = rospy.Subscriber(topic, kind, self._take, queue_size=1, buff_size=BUFFER)

    def close(self) -> int:
        """Finish the film; return how many pictures it has."""
        self._subscriber.unregister()
        with self._lock:
            self._film.close()
        return self._film.pictures

    def _take(self, message: CompressedImage | Image) -> None:
        try:
            pixels = _pixels(message)
            with self._lock:
                if not rospy.is_shutdown():
                    self._film.add(pixels, message.header.stamp.to_sec() or rospy.get_time())
        except ValueError as error:
            rospy.logwarn_throttle(10.0, f"a picture is left out of the film: {error}")
        except OSError as error:
            self.problem = f"{self._film.path} cannot be written: {error}"
            rospy.signal_shutdown(self.problem)


def _pixels(message: CompressedImage | Image) -> np.ndarray:
    """Return (height, width, 3) uint8, BGR, or (height, width) uint8, grey.

    Raises:
        ValueError: The picture cannot be read.
    """
    if not hasattr(message, "format"):
        return as_bgr(read_image_message(message), message.encoding)
    return decode_jpeg(message.data)


def main() -> int:
    """Film until the node is shut down; the exit code."""
    parser = argparse.ArgumentParser(prog="record_film", description="Writes a topic of pictures into an MP4 file.")
    parser.add_argument("topic")
    parser.add_argument("file", type=Path)
    arguments = parser.parse_args(rospy.myargv()[1:])
    narrow_sockets()
    connect_once()
    priority.step_back()
    rospy.init_node("film", anonymous=True)
    keep_logs_plain()
    node = FilmNode(arguments.topic, arguments.file)
    rospy.spin()
    pictures = node.close()
    if node.problem:
        print(node.problem, file=sys.stderr)
        return 1
    if not pictures:
        print(f"nobody published pictures on {arguments.topic}", file=sys.stderr)
        return NO_PICTURES
    return 0
