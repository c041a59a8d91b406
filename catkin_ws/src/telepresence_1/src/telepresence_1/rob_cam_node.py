"""ROS node rob_cam: a window with the robot's picture, for those who work without the operator's window.

Without a display the same picture is served as a web page on this machine instead.

Subscribes: the topic in ~image (sensor_msgs/Image); only the newest picture is ever shown.
Parameters:
    ~image ("/pepper_robot/camera/front/image_raw")
    ~port (10004)           of the page, when there is no display
Keys in the window: F full screen and back, Escape back, Q closes.
"""

from __future__ import annotations

import os
import sys
import time

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import Image
from telepresence_ros.node import Node

from telepresence.station.virtual_display import display_answers
from telepresence.video.displayable import as_bgr
from telepresence.video.images import LatestImage, read_image_message
from telepresence.video.mjpeg import MjpegStream
from telepresence.web.server import WebServer
from telepresence_1.page import create_app
from telepresence_1.placeholder_images import draw_notice

STALE_AFTER = 1.0
"""Seconds without a picture after which the last one does not count as live."""


def main() -> int:
    """Run the node; the exit code for the process."""
    node = Node("rob_cam")
    topic = str(rospy.get_param("~image", "/pepper_robot/camera/front/image_raw"))
    newest = LatestImage()  # of messages: they are taken apart by the thread that shows them
    rospy.Subscriber(topic, Image, lambda message: newest.put(message, message.header.stamp.to_sec()), queue_size=1)
    if display_answers(os.environ.get("DISPLAY")) or os.environ.get("QT_QPA_PLATFORM") == "offscreen":
        return show_window(newest, topic)
    return serve_page(node, newest, topic, int(rospy.get_param("~port", 10004)))


def show_window(newest: LatestImage, topic: str) -> int:
    """Open the window and stay until it is closed or the node ends."""
    from telepresence_1.picture_window import run_window

    rospy.loginfo("showing %s; F: full screen, Q: quit", topic)
    return run_window(newest, topic, rospy.is_shutdown)


def serve_page(node: Node, newest: LatestImage, topic: str, port: int) -> int:
    """Serve the picture on loopback until the node ends."""
    page = LatestImage()
    stream = MjpegStream(page)

    def describe() -> tuple[str, str]:
        return ("live", "Live") if newest.age() < STALE_AFTER else ("lost", f"No picture on {topic}")

    try:
        server = WebServer(create_app(stream, name="Robot's camera", describe=describe), port=port)
    except OSError as error:
        rospy.logfatal("there is no display, and no page instead: %s", error)
        return 1

    def show() -> None:
        sequence, complaint = 0, ""
        while not node.stop.is_set():
            picture = newest.wait_newer(sequence, timeout=0.5)
            try:
                if picture is not None:
                    sequence = picture.sequence
                    message = picture.pixels
                    page.put(_encode(as_bgr(read_image_message(message), message.encoding)), picture.stamp)
                elif newest.age() > STALE_AFTER:
                    page.put(_encode(draw_notice(640, 480, "No picture", f"Nothing comes on {topic}.", time.time())))
            except ValueError as error:
                if str(error) != complaint:
                    rospy.logerr("pictures on %s cannot be shown: %s", topic, error)
                    complaint = str(error)

    with server:
        rospy.logwarn("there is no display for a window; look at %s instead", server.url)
        return node.run(show)


def _encode(pixels: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", pixels, (cv2.IMWRITE_JPEG_QUALITY, 80))[1].tobytes()


if __name__ == "__main__":
    sys.exit(main())
