"""What rto_core's rto_node publishes besides, for programs that were written for it.

Publishes:  motor_readings (rto_msgs/MotorReadings, latched: speeds in rpm of the motors; REST knows neither their
            positions nor their currents, which are empty); rto_joint_states (sensor_msgs/JointState: joint_states in
            that node's order, nothing if it is remapped to joint_states); distance_sensors_clearing
            (sensor_msgs/PointCloud, latched: one point 5 m ahead in base_link, up to which a costmap forgets what the
            sensors no longer see).
Source: rto_node of dietriro/rto_core: names, types, order of the joints, the point. There it comes 720 times in a
message, and whether the robot answers or not. Points all around, which its authors may have meant, would make the
costmaps of rto_navigation forget what the laser saw and no longer sees: everything behind the robot, up to 5 m away.
"""

from __future__ import annotations

import rospy
from geometry_msgs.msg import Point32
from rto_msgs.msg import MotorReadings
from sensor_msgs.msg import JointState, PointCloud

from rto_node import robot_facts

ORDER = (2, 0, 1)
"""The wheels, in that node's order."""


class RtoCoreTopics:
    """Says once more what the driver has read."""

    def __init__(self) -> None:
        self._motors = rospy.Publisher("motor_readings", MotorReadings, queue_size=1, latch=True)
        self._clearing = rospy.Publisher("distance_sensors_clearing", PointCloud, queue_size=1, latch=True)
        self._joints: rospy.Publisher | None = None
        if rospy.resolve_name("rto_joint_states") != rospy.resolve_name("joint_states"):
            self._joints = rospy.Publisher("rto_joint_states", JointState, queue_size=1)

    def publish_wheels(self, wheels: JointState) -> None:
        """Publish what joint_states says [rad, rad/s]."""
        self._motors.publish(MotorReadings(wheels.header.stamp, robot_facts.motor_speeds(wheels.velocity), [], []))
        if self._joints is not None:
            message = JointState(header=wheels.header)
            message.name = [wheels.name[i] for i in ORDER]
            message.position = [wheels.position[i] for i in ORDER]
            message.velocity = [wheels.velocity[i] for i in ORDER]
            self._joints.publish(message)

    def publish_clearing(self, stamp: rospy.Time) -> None:
        """Publish the point. With each reading of the distances, and only then: a costmap that sees nothing new must
        not forget either."""
        message = PointCloud(points=[Point32(*robot_facts.CLEARING_POINT)])
        message.header.stamp, message.header.frame_id = stamp, "base_link"
        self._clearing.publish(message)
