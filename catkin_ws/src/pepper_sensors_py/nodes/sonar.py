#!/usr/bin/env python3
"""The robot's sonars.

Publishes:  sonar/front and sonar/back (sensor_msgs/Range; infinity when nothing is within 2.55 m), /diagnostics. With
            ~memory_key: only that one, on the topic sonar.
Parameters: ~sonar_rate (10) [Hz]; ~memory_key and ~frame_id: one sonar instead of both.
"""

import sys
from collections.abc import Sequence

import rospy
from naoqi_driver.connection import CallRefused, RobotError
from naoqi_driver.naoqi_node import NaoqiNode
from naoqi_driver.replies import sequence
from pepper_sensors.sonar import BACK, FIELD_OF_VIEW, FRONT, MAX_RANGE, MIN_RANGE, SUBSCRIBER, Sonar, to_range
from sensor_msgs.msg import Range
from telepresence_ros.diagnostics import ERROR, OK, Diagnostics


class SonarNode:
    def __init__(self) -> None:
        self._node = NaoqiNode("sonar")
        self._period = 1.0 / float(rospy.get_param("~sonar_rate", 10.0))
        key = rospy.get_param("~memory_key", "")
        self._sonars = [Sonar(key, rospy.get_param("~frame_id", FRONT.frame_id), "sonar")] if key else [FRONT, BACK]
        self._publishers = [rospy.Publisher(sonar.topic, Range, queue_size=1) for sonar in self._sonars]
        self._diagnostics = Diagnostics("sonar", str(self._node.connection.address))
        self._link = 0

    def run(self) -> int:
        return self._node.run(self._loop)

    def _loop(self) -> None:
        keys = [sonar.key for sonar in self._sonars]
        for now in self._node.cycles(self._period):
            try:
                self._switch_on()
                values = sequence(self._node.connection.call("ALMemory", "getListData", keys), "sonars", len(keys))
            except RobotError as error:
                self._diagnostics.report(now, ERROR, str(error))
                continue
            self._publish(values)
            self._diagnostics.report(now, OK, "on")
        self._switch_off()

    def _switch_on(self) -> None:
        """The sonars ping only while somebody is subscribed to them."""
        if self._link != self._node.connection.connections:
            link = self._node.connection.connections
            try:
                self._node.connection.call("ALSonar", "subscribe", SUBSCRIBER)
            except CallRefused as error:
                # From NAOqi 2.9 on they are on without it (ros-naoqi/naoqi_driver).
                rospy.logwarn("the sonars may be off: %s", error)
            self._link = link

    def _switch_off(self) -> None:
        if self._node.connection.connected and self._link == self._node.connection.connections:
            try:
                self._node.connection.call("ALSonar", "unsubscribe", SUBSCRIBER)
            except RobotError as error:
                rospy.logwarn("could not switch the sonars off: %s", error)

    def _publish(self, values: Sequence[object]) -> None:
        for sonar, publisher, value in zip(self._sonars, self._publishers, values, strict=True):
            message = Range(
                radiation_type=Range.ULTRASOUND,
                field_of_view=FIELD_OF_VIEW,
                min_range=MIN_RANGE,
                max_range=MAX_RANGE,
                range=to_range(value),
            )
            message.header.stamp = rospy.Time.now()
            message.header.frame_id = sonar.frame_id
            publisher.publish(message)


if __name__ == "__main__":
    sys.exit(SonarNode().run())
