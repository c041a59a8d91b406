#!/usr/bin/env python3
"""One camera of the robot.

Publishes:  ~image_raw (sensor_msgs/Image), ~image_raw/compressed (sensor_msgs/CompressedImage, JPEG),
            ~camera_info (sensor_msgs/CameraInfo), all only while somebody subscribes; /diagnostics with rate and age.
Parameters: ~source (0): 0 top, 1 bottom, 2 depth, 3 stereo: left and right eye side by side, camera_info of one eye.
            ~resolution (1): NAOqi's id, 0 160x120, 1 320x240, 2 640x480; head 1.8: depth 9 640x360, stereo 15 640x180.
            ~color_space (13): NAOqi's id; 9 (YUV422, a third fewer bytes), 11 RGB, 13 BGR, 17 depth [mm] and others.
            ~frame_rate (15) [pictures/s].
            ~use_ros_time (false): false stamps a picture with the moment it was taken, by the robot's clock, which is
            corrected when it differs from ours by more than half a second; true stamps it with its arrival.
            ~calibration_file_top, ~calibration_file_bottom: files of camera_calibration, by path, file:///PATH or
            package://PACKAGE/PATH; without one the camera model follows from the view angles that come with every
            picture.
"""

import socket
import sys
import time

import numpy as np
import rospy
from naoqi_driver.connection import CallRefused, RobotUnreachable
from naoqi_driver.naoqi_node import NaoqiNode
from pepper_sensors.camera import CAMERAS, Camera, CameraPicture, RobotClock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from telepresence_ros.calibration_parameter import calibration_of
from telepresence_ros.camera_model import pinhole
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics
from telepresence_ros.node import ROBOT_PATIENCE

from telepresence.station import heartbeat
from telepresence.video.images import fill_image_message
from telepresence.video.jpeg import encode_jpeg

IDLE_PERIOD = 0.1
"""Seconds between two checks for subscribers."""
LINGER = 2.0
"""Seconds that the robot's camera stays subscribed without readers: cheaper than to subscribe anew at every glance."""
RETRY_PERIOD = 1.0
CALIBRATION_FILES = {"CameraTop": "~calibration_file_top", "CameraBottom": "~calibration_file_bottom"}
"""Camera -> parameter; depth and stereo have none."""


class CameraNode:
    def __init__(self) -> None:
        self._node = NaoqiNode("camera")
        source = int(rospy.get_param("~source", 0))
        # Our name at the robot holds node and machine, so that two pilots' stations do not end each other's pictures.
        name = f"{rospy.get_name().strip('/').replace('/', '_')}_{socket.gethostname()}"
        try:
            self._camera = Camera(
                self._node.connection,
                name,
                source,
                int(rospy.get_param("~resolution", 1)),
                int(rospy.get_param("~color_space", 13)),
                int(rospy.get_param("~frame_rate", 15)),
            )
        except ValueError as error:
            sys.exit(f"{rospy.get_name()}: {error}")
        parameter = CALIBRATION_FILES.get(CAMERAS[source])
        self._calibration = calibration_of(parameter) if parameter else None
        self._use_ros_time = bool(rospy.get_param("~use_ros_time", False))
        self._clock = RobotClock()
        self._image = rospy.Publisher("~image_raw", Image, queue_size=1)
        self._compressed = rospy.Publisher("~image_raw/compressed", CompressedImage, queue_size=1)
        self._info = rospy.Publisher("~camera_info", CameraInfo, queue_size=1)
        self._diagnostics = Diagnostics(CAMERAS[source], str(self._node.connection.address))
        self._counted, self._counted_since, self._age = 0, time.monotonic(), 0.0

    def run(self) -> int:
        return self._node.run(self._loop)

    @property
    def _wanted(self) -> bool:
        return any(publisher.get_num_connections() for publisher in (self._image, self._compressed, self._info))

    def _loop(self) -> None:
        wanted_at = -LINGER
        while not self._node.stop.is_set():
            heartbeat.beat(ROBOT_PATIENCE)
            now = time.monotonic()
            if self._wanted:
                wanted_at = now
            elif now - wanted_at > LINGER:
                self._camera.close()
                self._counted, self._counted_since = 0, now
                self._diagnostics.report(now, OK, "nobody subscribes")
                self._node.stop.wait(IDLE_PERIOD)
                continue
            self._node.stop.wait(self._show_next(now))
        self._camera.close()

    def _show_next(self, now: float) -> float:
        """Fetch and publish one picture; how long to wait for the next [s]."""
        try:
            picture = self._camera.grab()
            if picture is not None:
                self._publish(picture)
        except RobotUnreachable as error:
            self._diagnostics.report(now, ERROR, str(error))
            return RETRY_PERIOD if self._node.connection.connected else IDLE_PERIOD
        except (CallRefused, ValueError) as error:
            rospy.logwarn_throttle(10, "no picture: %s", error)
            self._diagnostics.report(now, ERROR, str(error))
            return RETRY_PERIOD
        if picture is None:
            return self._camera.period / 4
        self._counted += 1
        rate = self._counted / max(now - self._counted_since, 1e-3)
        level = OK if rate > 0.5 / self._camera.period else WARN
        values = {
            "pictures/s": f"{rate:.1f}",
            "wanted pictures/s": f"{1 / self._camera.period:.0f}",
            "age at arrival [s]": f"{self._age:.3f}",
            "robot's clock is behind by [s]": f"{self._clock.difference:.3f}",
        }
        if self._diagnostics.report(now, level, f"{rate:.1f} pictures/s", values):
            self._counted, self._counted_since = 0, now
        # The robot answers with its newest picture; ask again when the next one may be there.
        return max(0.0, self._camera.period * 0.9 - (time.monotonic() - now))

    def _publish(self, picture: CameraPicture) -> None:
        arrival = time.time()
        taken = self._clock.to_local(picture.stamp, arrival)
        self._age = arrival - taken
        stamp = rospy.Time.from_sec(arrival if self._use_ros_time else taken)
        height, width = picture.pixels.shape[:2]
        if self._image.get_num_connections():
            message = fill_image_message(Image(), picture.pixels, picture.encoding)
            message.header.stamp, message.header.frame_id = stamp, self._camera.frame_id
            self._image.publish(message)
        if self._compressed.get_num_connections() and picture.pixels.dtype == np.uint8:
            jpeg = encode_jpeg(picture.pixels, order="rgb" if picture.encoding == "rgb8" else "bgr")
            message = CompressedImage(format="jpeg", data=jpeg)
            message.header.stamp, message.header.frame_id = stamp, self._camera.frame_id
            self._compressed.publish(message)
        if self._info.get_num_connections():
            width //= self._camera.views
            model = self._calibration.scaled(width, height) if self._calibration else None
            model = model or pinhole(width, height, picture.angles)
            message = CameraInfo(height=height, width=width, distortion_model=model.distortion_model)
            message.D, message.K, message.R, message.P = model.D, model.K, model.R, model.P
            message.header.stamp, message.header.frame_id = stamp, self._camera.frame_id
            self._info.publish(message)


if __name__ == "__main__":
    sys.exit(CameraNode().run())
