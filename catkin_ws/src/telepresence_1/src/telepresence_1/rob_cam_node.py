"""ROS node rob_cam: a window with the robot's picture, for those who work without the operator's window.

    rosrun telepresence_1 rob_cam.py              shows the camera's topic
    rosrun telepresence_1 rob_cam.py IP [PORT]    opens the camera of the robot there itself; needs no ROS master

Without a display the same picture is served as a web page on this machine instead, for whoever has the key that the
program prints.

Subscribes: the topic in ~image (sensor_msgs/Image); only the newest picture is ever shown.
Parameters:
    ~image ("/pepper_robot/camera/front/image_raw")
    ~port (10004)           of the page, when there is no display
Keys in the window: F full screen and back, Escape back, Q closes.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
import threading
import time
from collections.abc import Callable

import rospy
from naoqi_driver.connection import Address
from sensor_msgs.msg import Image
from telepresence_ros.node import Node, stop_on_signals

from telepresence import ports
from telepresence.station.virtual_display import display_answers
from telepresence.video.displayable import as_bgr
from telepresence.video.images import LatestImage, read_image_message
from telepresence.video.jpeg import encode_jpeg
from telepresence.video.mjpeg import MjpegStream
from telepresence.web.page_auth import page_key
from telepresence.web.server import WebServer
from telepresence_1.page import KEY_VARIABLE, create_app
from telepresence_1.placeholder_images import draw_notice
from telepresence_1.robot_camera import RobotCamera

log = logging.getLogger(__name__)

STALE_AFTER = 1.0
"""Seconds without a picture after which the last one does not count as live."""


def main() -> int:
    """Run the program; the exit code for the process."""
    parser = argparse.ArgumentParser(prog="rob_cam.py", description="Show the robot's camera in a window.")
    parser.add_argument("ip", nargs="?", help="open the camera of the robot there, without ROS")
    parser.add_argument(
        "port", nargs="?", type=int, default=9559, help="port of the robot's NAOqi; default %(default)s"
    )
    parser.add_argument(
        "--page-port",
        type=int,
        default=ports.ROBOT_PICTURES,
        help="port of the page when there is no display; default %(default)s",
    )
    options = parser.parse_args(rospy.myargv(sys.argv)[1:])
    return (
        show_topic(options.page_port) if options.ip is None else show_robot(options.ip, options.port, options.page_port)
    )


def show_topic(page_port: int) -> int:
    """Show what a camera's topic brings, as a ROS node."""
    node = Node("rob_cam")
    topic = str(rospy.get_param("~image", "/pepper_robot/camera/front/image_raw"))
    newest = LatestImage()  # of messages: they are taken apart by the thread that shows them
    rospy.Subscriber(topic, Image, lambda message: newest.put(message, message.header.stamp.to_sec()), queue_size=1)
    if has_display():
        return show_window(newest, topic, rospy.is_shutdown)
    return serve_page(newest, topic, int(rospy.get_param("~port", page_port)), node.stop, node.run)


def show_robot(ip: str, port: int, page_port: int) -> int:
    """Show the camera of the robot at this address; there is no ROS node."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    logging.getLogger("rospy").setLevel(logging.WARNING)  # it is no node
    try:
        robot = Address.parse(ip, port)
    except ValueError as error:
        print(f"rob_cam.py: {error}", file=sys.stderr)
        return 1
    stop = stop_on_signals(threading.Event())
    newest = LatestImage()
    with RobotCamera(robot, newest):
        if has_display():
            return show_window(newest, robot.url, stop.is_set)

        def run(loop: Callable[[], None]) -> int:
            loop()
            return 0

        return serve_page(newest, robot.url, page_port, stop, run)


def has_display() -> bool:
    """Whether a window can be opened."""
    return display_answers(os.environ.get("DISPLAY")) or os.environ.get("QT_QPA_PLATFORM") == "offscreen"


def show_window(newest: LatestImage, source: str, ended: Callable[[], bool]) -> int:
    """Open the window and stay until it is closed or `ended()`."""
    from telepresence_1.picture_window import run_window

    log.info("showing %s; F: full screen, Q: quit", source)
    return run_window(newest, source, ended)


def serve_page(
    newest: LatestImage,
    source: str,
    port: int,
    stop: threading.Event,
    run: Callable[[Callable[[], None]], int],
) -> int:
    """Serve the picture on loopback until `stop` is set; `run` runs the loop that does it."""
    page = LatestImage()
    stream = MjpegStream(page)

    def describe() -> tuple[str, str]:
        return ("live", "Live") if newest.age() < STALE_AFTER else ("lost", f"No picture from {source}")

    try:
        key = page_key(KEY_VARIABLE)
        server = WebServer(create_app(stream, name="Robot's camera", describe=describe, token=key), port=port)
    except OSError as error:
        log.critical("there is no display, and no page instead: %s", error)
        return 1

    def show() -> None:
        sequence, complaint = 0, ""
        while not stop.is_set():
            picture = newest.wait_newer(sequence, timeout=0.5)
            try:
                if picture is not None:
                    sequence = picture.sequence
                    message = picture.content
                    pixels = as_bgr(read_image_message(message), message.encoding)
                    page.put(encode_jpeg(pixels, order="bgr"), picture.stamp)
                elif newest.age() > STALE_AFTER:
                    notice = draw_notice(640, 480, "No picture", f"Nothing comes from {source}.", time.time())
                    page.put(encode_jpeg(notice, order="bgr"))
            except ValueError as error:
                if str(error) != complaint:
                    log.error("pictures from %s cannot be shown: %s", source, error)
                    complaint = str(error)

    with server:
        log.warning("there is no display for a window; look at %s instead", server.url)
        # To the terminal only: everybody on the ROS network can read /rosout.
        print(f"with its key, for your browser: {server.url}?k={key}", flush=True)
        return run(show)


if __name__ == "__main__":
    sys.exit(main())
