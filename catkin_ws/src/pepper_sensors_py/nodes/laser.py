#!/usr/bin/env python3
"""The robot's laser lines.

Publishes:  laser (sensor_msgs/LaserScan): the three horizontal lines together, in base_footprint; blind sectors are
            NaN. laser/<line>/scan (LaserScan) and laser/<line>/pointcloud (PointCloud2) for the lines srd_front,
            srd_left, srd_right, shovel, ground_left, ground_right, each in the frame on the floor under its camera;
            all only while somebody subscribes. pepper_navigation/front (LaserScan): the front line under its old
            second name. /diagnostics.
Parameters: ~laser_rate (6.25) [Hz], what the sensor does; ~laser_<line>_frame_id: another frame for a line;
            ~pointcloud (true), ~laserscan (true): whether the topics of the lines exist.
"""

import sys

import numpy as np
import rospy
from naoqi_driver.connection import RobotError
from naoqi_driver.laser_points import LINES, hits
from naoqi_driver.naoqi_node import NaoqiNode
from naoqi_driver.robot_facts import MAX_RANGE, MIN_RANGE
from pepper_sensors.laser import (
    AROUND_MAX_RANGE,
    KEYS,
    SUBSCRIBER,
    Scan,
    count_missing,
    merge,
    read_points,
    to_scan,
)
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics

_XYZ = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate("xyz")]


class LaserNode:
    def __init__(self) -> None:
        self._node = NaoqiNode("pepper_laser")
        self._period = 1.0 / float(rospy.get_param("~laser_rate", 6.25))
        self._frames = {
            name: rospy.get_param(f"~laser_{name}_frame_id", line.frame.frame_id) for name, line in LINES.items()
        }
        self._around = rospy.Publisher("laser", LaserScan, queue_size=1)
        self._navigation = rospy.Publisher("pepper_navigation/front", LaserScan, queue_size=1)
        scans = LINES if rospy.get_param("~laserscan", True) else ()
        clouds = LINES if rospy.get_param("~pointcloud", True) else ()
        self._scans = {name: rospy.Publisher(f"laser/{name}/scan", LaserScan, queue_size=1) for name in scans}
        self._clouds = {name: rospy.Publisher(f"laser/{name}/pointcloud", PointCloud2, queue_size=1) for name in clouds}
        self._diagnostics = Diagnostics("lasers", str(self._node.connection.address))
        self._link = 0

    def run(self) -> int:
        return self._node.run(self._loop)

    def _loop(self) -> None:
        for now in self._node.cycles(self._period):
            try:
                self._switch_on()
                values = self._node.connection.call("ALMemory", "getListData", list(KEYS))
                points = read_points(values)
            except RobotError as error:
                self._diagnostics.report(now, ERROR, str(error))
                continue
            self._publish(points, rospy.Time.now())
            missing = count_missing(values)
            self._diagnostics.report(
                now, WARN if missing else OK, f"{missing} values are missing" if missing else "all points present"
            )

    def _switch_on(self) -> None:
        """Subscribe to ALLaser where there is such a service; on Pepper the lasers are on without it."""
        if self._link == self._node.connection.connections:
            return
        link = self._node.connection.connections
        try:
            self._node.connection.call("ALLaser", "subscribe", SUBSCRIBER)
        except RobotError as error:
            if not self._node.connection.connected:
                raise
            rospy.logdebug("%s", error)
        self._link = link

    def _publish(self, points: dict[str, np.ndarray], stamp: rospy.Time) -> None:
        if self._around.get_num_connections():
            around = self._scan_message(merge(points), stamp, "base_footprint")
            around.range_max = AROUND_MAX_RANGE
            self._around.publish(around)
        if self._navigation.get_num_connections():
            front = to_scan(points["srd_front"])
            self._navigation.publish(self._scan_message(front, stamp, self._frames["srd_front"]))
        for name, publisher in self._scans.items():
            if publisher.get_num_connections():
                publisher.publish(self._scan_message(to_scan(points[name]), stamp, self._frames[name]))
        for name, publisher in self._clouds.items():
            if publisher.get_num_connections():
                publisher.publish(self._cloud_message(points[name], stamp, self._frames[name]))

    def _scan_message(self, scan: Scan, stamp: rospy.Time, frame: str) -> LaserScan:
        message = LaserScan(
            angle_min=scan.angle_min,
            angle_max=scan.angle_max,
            angle_increment=scan.increment,
            scan_time=self._period,
            range_min=MIN_RANGE,
            range_max=MAX_RANGE,
            ranges=scan.ranges.tolist(),
        )
        message.header.stamp, message.header.frame_id = stamp, frame
        return message

    @staticmethod
    def _cloud_message(points: np.ndarray, stamp: rospy.Time, frame: str) -> PointCloud2:
        hit = points[hits(points)]
        xyz = np.column_stack((hit, np.zeros(len(hit)))).astype("<f4")
        message = PointCloud2(
            height=1, width=len(xyz), fields=_XYZ, point_step=12, row_step=12 * len(xyz), data=xyz.tobytes()
        )
        message.is_dense = True
        message.header.stamp, message.header.frame_id = stamp, frame
        return message


if __name__ == "__main__":
    sys.exit(LaserNode().run())
