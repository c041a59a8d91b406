"""The node rto_camera_node: the robot's own pictures, for a robot whose camera sends nothing better.

Asks /cam0 only while somebody subscribes. A picture that cannot be had is no error: the camera needs a moment to wake.

Publishes:  image_raw (sensor_msgs/Image, bgr8), image_raw/compressed (sensor_msgs/CompressedImage, as it came), both
            newest only; camera_info; /diagnostics.
Parameters: ~hostname, ~rate (15) [Hz], ~frame_id (camera_optical_frame), ~calibration_file: of camera_calibration;
            without one ~focal_length (526.4) [px at a width of 640], see `camera_calibration`.
"""

from __future__ import annotations

import time

import rospy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics
from telepresence_ros.node import ROBOT_PATIENCE, Node

from rto_node.camera_calibration import CameraCalibration
from rto_node.client import RobotinoClient
from rto_node.link import Link, find_address
from telepresence.video.images import fill_image_message
from telepresence.video.jpeg import decode_jpeg

IDLE_PERIOD = 0.2
"""Seconds between two checks for subscribers."""


class CameraNode:
    def __init__(self) -> None:
        self._node = Node("rto_camera_node")
        address = find_address()
        self._link = Link(address)
        self._period = 1.0 / float(rospy.get_param("~rate", 15.0))
        self._frame = rospy.get_param("~frame_id", "camera_optical_frame")
        self._calibration = CameraCalibration()
        self._image = rospy.Publisher("image_raw", Image, queue_size=1)
        self._compressed = rospy.Publisher("image_raw/compressed", CompressedImage, queue_size=1)
        self._info = rospy.Publisher("camera_info", CameraInfo, queue_size=1)
        self._diagnostics = Diagnostics("camera", address)
        self._pictures = 0

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._node.run(self._poll)

    def _poll(self) -> None:
        counted_at = time.monotonic()
        for now in self._node.cycles(self._period, ROBOT_PATIENCE):
            if not any(topic.get_num_connections() for topic in (self._image, self._compressed, self._info)):
                self._diagnostics.report(now, OK, "nobody looks")
                self._node.stop.wait(IDLE_PERIOD)
                continue
            self._link.ask(self._fetch)
            rate = self._pictures / max(1e-3, now - counted_at)
            level = ERROR if self._link.problem else OK if self._pictures else WARN
            if self._diagnostics.report(now, level, self._link.problem or f"{rate:.1f} pictures/s"):
                self._pictures, counted_at = 0, now
        self._link.client.close()

    def _fetch(self, client: RobotinoClient) -> None:
        stamp = rospy.Time.now()  # of the question: the picture is older, never younger
        data = client.picture()
        if data is None:
            rospy.logdebug("the camera has no picture yet")
            return
        try:
            pixels = decode_jpeg(data)
        except ValueError as error:
            rospy.logwarn_throttle(10.0, "the robot's picture is left out: %s", error)
            return
        if self._compressed.get_num_connections():
            compressed = CompressedImage(format="jpeg", data=data)
            compressed.header.stamp, compressed.header.frame_id = stamp, self._frame
            self._compressed.publish(compressed)
        self._pictures += 1
        image = fill_image_message(Image(), pixels, "bgr8")
        image.header.stamp, image.header.frame_id = stamp, self._frame
        self._image.publish(image)
        self._info.publish(self._calibration.info(image))


def main() -> int:
    """Run the node; the exit code."""
    return CameraNode().run()
