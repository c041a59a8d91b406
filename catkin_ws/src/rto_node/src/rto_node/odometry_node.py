"""The node rto_odometry_node: where the robot is, 20 times a second; silent while the robot counts no further readings.

Publishes:  odom (nav_msgs/Odometry, frame odom, child base_link), /tf odom -> base_link, /diagnostics;
            odom_restarted (std_msgs/Empty): what was placed in odom before may be elsewhere now, because the robot's
            odometry has started again, or was reset.
Services:   reset_odometry (rto_msgs/ResetOdometry): the robot is at x, y, phi now. Robotino's REST interface has no
            reset, so the origin is moved here.
Parameters: ~hostname, ~rate (20) [Hz], ~odom_frame_id (odom), ~base_frame_id (base_link), ~publish_tf (true).
"""

from __future__ import annotations

import math
import threading
import time

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped
from nav_msgs.msg import Odometry as OdometryMessage
from rto_msgs.srv import ResetOdometry, ResetOdometryResponse
from std_msgs.msg import Empty
from telepresence_ros.diagnostics import ERROR, OK, Diagnostics
from telepresence_ros.node import ROBOT_PATIENCE, Node
from telepresence_ros.odometry_covariance import covariance
from tf2_msgs.msg import TFMessage

from rto_node.client import Odometry, RobotinoClient, RobotinoError
from rto_node.link import Link, find_address
from rto_node.odometry_frame import OdometryFrame, Pose
from rto_node.reading_count import ReadingCount


class OdometryNode:
    def __init__(self) -> None:
        self._node = Node("rto_odometry_node")
        address = find_address()
        self._link = Link(address)
        self._period = 1.0 / float(rospy.get_param("~rate", 20.0))
        self._odom_frame = rospy.get_param("~odom_frame_id", "odom")
        self._base_frame = rospy.get_param("~base_frame_id", "base_link")
        self._frame = OdometryFrame()
        self._count = ReadingCount()
        self._lock = threading.Lock()  # protects the frame between the loop and the service
        self._restarts = 0
        self._odom = rospy.Publisher("odom", OdometryMessage, queue_size=1)
        self._restarted = rospy.Publisher("odom_restarted", Empty, queue_size=1)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10) if rospy.get_param("~publish_tf", True) else None
        self._diagnostics = Diagnostics("odometry", address)
        rospy.Service("reset_odometry", ResetOdometry, self._on_reset)

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._node.run(self._poll)

    def _on_reset(self, request: ResetOdometry) -> ResetOdometryResponse:
        if not all(map(math.isfinite, (request.x, request.y, request.phi))):
            raise rospy.ServiceException(f"{request.x}, {request.y}, {request.phi} is not a pose")
        with self._lock:
            self._frame.reset(request.x, request.y, request.phi)
        self._restarted.publish(Empty())
        return ResetOdometryResponse()

    def _poll(self) -> None:
        read, counted_at = 0, time.monotonic()
        for now in self._node.cycles(self._period, ROBOT_PATIENCE):
            read += self._link.ask(self._read)
            problem = self._link.problem
            message = problem or f"{read / max(1e-3, now - counted_at):.1f} readings/s"
            if self._diagnostics.report(now, ERROR if problem else OK, message):
                read, counted_at = 0, now
        self._link.client.close()

    def _read(self, client: RobotinoClient) -> None:
        asked = time.monotonic()
        reading = client.odometry()
        stamp = rospy.Time.now()
        if not self._count.take(reading.seq, asked):
            if old := self._count.problem(asked):
                raise RobotinoError(f"Robotino at {client.address} {old}")
            return
        with self._lock:
            pose = self._frame.update(reading)
        if self._frame.restarts != self._restarts:
            self._restarts = self._frame.restarts
            rospy.logwarn("the robot's odometry has started again; %s goes on from where it was", self._odom_frame)
            self._restarted.publish(Empty())
        self._publish(pose, reading, stamp)

    def _publish(self, pose: Pose, reading: Odometry, stamp: rospy.Time) -> None:
        x, y, phi = pose
        orientation = Quaternion(0.0, 0.0, math.sin(phi / 2), math.cos(phi / 2))
        message = OdometryMessage()
        message.header.stamp, message.header.frame_id = stamp, self._odom_frame
        message.child_frame_id = self._base_frame
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation = orientation
        twist = message.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = reading.vx, reading.vy, reading.omega
        message.pose.covariance = message.twist.covariance = covariance()
        self._odom.publish(message)
        if self._tf is not None:
            transform = TransformStamped()
            transform.header, transform.child_frame_id = message.header, self._base_frame
            transform.transform.translation.x, transform.transform.translation.y = x, y
            transform.transform.rotation = orientation
            self._tf.publish(TFMessage([transform]))


def main() -> int:
    """Run the node; the exit code."""
    return OdometryNode().run()
