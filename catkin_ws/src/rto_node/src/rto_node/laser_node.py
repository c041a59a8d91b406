"""The node rto_laserrangefinder_node: the laser scanner, for robots that carry one.

Publishes:  scan (sensor_msgs/LaserScan, frame laser_link; infinity where nothing was hit), /diagnostics.
Parameters: ~hostname, ~rate (10) [Hz], ~frame_id (laser_link).
"""

from __future__ import annotations

import math

import rospy
from sensor_msgs.msg import LaserScan
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics
from telepresence_ros.node import ROBOT_PATIENCE, Node

from rto_node.client import RobotinoClient, Scan
from rto_node.link import Link, find_address

ABSENT_PERIOD = 2.0
"""Seconds between two questions to a robot without a laser."""


class LaserNode:
    def __init__(self) -> None:
        self._node = Node("rto_laserrangefinder_node")
        address = find_address()
        self._link = Link(address)
        self._period = 1.0 / float(rospy.get_param("~rate", 10.0))
        self._frame = rospy.get_param("~frame_id", "laser_link")
        self._scans = rospy.Publisher("scan", LaserScan, queue_size=1)
        self._diagnostics = Diagnostics("laser", address)
        self._last: Scan | None = None

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._node.run(self._poll)

    def _poll(self) -> None:
        for now in self._node.cycles(self._period, ROBOT_PATIENCE):
            reached = self._link.ask(self._read)
            if not reached:
                self._diagnostics.report(now, ERROR, self._link.problem)
            elif self._last is None:
                self._diagnostics.report(now, WARN, "this robot has no laser")
                self._node.stop.wait(ABSENT_PERIOD)
            else:
                self._diagnostics.report(now, OK, f"{len(self._last.ranges)} ranges")
        self._link.client.close()

    def _read(self, client: RobotinoClient) -> None:
        scan = client.scan()
        if scan is not None and (self._last is None or scan.seq != self._last.seq):
            self._scans.publish(self._message(scan))
        self._last = scan

    def _message(self, scan: Scan) -> LaserScan:
        message = LaserScan()
        message.header.stamp, message.header.frame_id = rospy.Time.now(), self._frame
        message.angle_min, message.angle_increment = scan.angle_min, scan.angle_increment
        # The robot's own angle_max is one step further than its last ray.
        message.angle_max = scan.angle_min + scan.angle_increment * (len(scan.ranges) - 1)
        message.time_increment, message.scan_time = scan.time_increment, scan.scan_time
        message.range_min, message.range_max = scan.range_min, scan.range_max
        message.ranges = [distance if distance > 0.0 else math.inf for distance in scan.ranges]
        return message


def main() -> int:
    """Run the node; the exit code."""
    return LaserNode().run()
