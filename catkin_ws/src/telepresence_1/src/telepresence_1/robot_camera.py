"""Pictures straight from a robot's head, without ROS: what `rob_cam.py IP PORT` shows."""

from __future__ import annotations

import logging
import threading

from naoqi_driver.connection import Address, Connection, RobotError
from pepper_sensors.camera import Camera
from sensor_msgs.msg import Image

from telepresence.video.images import LatestImage, fill_image_message

log = logging.getLogger(__name__)

NAME, TOP_CAMERA, VGA, RGB, RATE = "pyth12", 0, 2, 11, 15
"""The report's subscription: 640x480, kRGBColorSpace, 15 pictures/s."""
PAUSE = 1.0
"""Seconds before a robot that gave no picture is asked again."""


class RobotCamera:
    """Puts the top camera's pictures, as sensor_msgs/Image, into `newest` between `start` and `close`."""

    def __init__(self, robot: Address, newest: LatestImage) -> None:
        self._newest = newest
        self._connection = Connection(robot)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="robot-camera", daemon=True)

    def start(self) -> RobotCamera:
        self._connection.start()
        self._thread.start()
        return self

    def close(self) -> None:
        """Give the camera back and end the link; at most about three seconds."""
        self._stop.set()
        self._thread.join(timeout=2.0)
        self._connection.close()

    def __enter__(self) -> RobotCamera:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        problem = ""
        while not self._stop.is_set():
            if not self._connection.wait_connected(0.2):
                continue
            camera = Camera(self._connection, NAME, TOP_CAMERA, VGA, RGB, RATE)
            try:
                self._film(camera)
            except (RobotError, ValueError) as error:
                if str(error) != problem:
                    problem = str(error)
                    log.warning("no picture from the robot: %s; trying again", problem)
                self._stop.wait(PAUSE)
            finally:
                camera.close()

    def _film(self, camera: Camera) -> None:
        while not self._stop.is_set():
            picture = camera.grab()
            if picture is None:
                self._stop.wait(camera.period / 10)
            else:
                self._newest.put(fill_image_message(Image(), picture.pixels, picture.encoding), picture.stamp)
