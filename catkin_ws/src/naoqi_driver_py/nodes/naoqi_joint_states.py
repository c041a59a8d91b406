#!/usr/bin/env python3
"""Where the robot is and how it holds its joints, 25 times a second.

Publishes:  odom (nav_msgs/Odometry), imu and imu/torso (sensor_msgs/Imu, of the torso), imu/base (of the base),
            joint_states, joint_stiffness (sensor_msgs/JointState; the stiffness, 0 to 1, stands in the field effort),
            /tf odom -> base_link, /diagnostics.
Parameters: ~sensor_rate (25) [Hz], ~odom_frame_id (odom), ~use_odometry (true), ~use_joint_sensors (true),
            ~base_frame_id (base_link, which is the torso: six degrees of freedom. With base_footprint the topic odom
            gives the place on the floor, as REP 105 has it; the transform stays odom -> base_link, the root of the
            robot's tree).
Stamps are the ROS time at which the reading arrived: the robot's keys carry none.
"""

import sys

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped
from naoqi_driver import body
from naoqi_driver.body import WHEELS, BodyReader, BodyState, all_finite, quaternion
from naoqi_driver.connection import CallRefused, RobotUnreachable
from naoqi_driver.naoqi_node import NaoqiNode
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from telepresence_ros.diagnostics import ERROR, OK, Diagnostics
from telepresence_ros.odometry_covariance import covariance
from tf2_msgs.msg import TFMessage


class JointStates:
    def __init__(self) -> None:
        self._node = NaoqiNode("naoqi_joint_states")
        self._period = 1.0 / float(rospy.get_param("~sensor_rate", 25.0))
        self._base_frame = rospy.get_param("~base_frame_id", "base_link")
        self._odom_frame = rospy.get_param("~odom_frame_id", "odom")
        self._use_odometry = bool(rospy.get_param("~use_odometry", True))
        self._reader = BodyReader(self._node.connection, bool(rospy.get_param("~use_joint_sensors", True)))
        self._wheel_angles = [0.0] * len(WHEELS)
        self._links = 0
        self._readings = 0
        self._odom = rospy.Publisher("odom", Odometry, queue_size=1)
        self._imus = {name: rospy.Publisher(name, Imu, queue_size=1) for name in ("imu", "imu/torso", "imu/base")}
        self._joints = rospy.Publisher("joint_states", JointState, queue_size=1)
        self._stiffness = rospy.Publisher("joint_stiffness", JointState, queue_size=1)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10)
        self._diagnostics = Diagnostics("joint states", str(self._node.connection.address))

    def run(self) -> int:
        return self._node.run(self._loop)

    def _loop(self) -> None:
        before, counted, counted_at = None, 0, None
        for now in self._node.cycles(self._period):
            counted_at = now if counted_at is None else counted_at
            try:
                if self._links != self._node.connection.connections:
                    self._reader.prepare()
                    self._links = self._node.connection.connections
                state = self._reader.read()
            except RobotUnreachable as error:
                self._diagnostics.report(now, ERROR, str(error))
                before = None
                continue
            except CallRefused as error:
                rospy.logwarn_throttle(10, "%s", error)
                self._diagnostics.report(now, ERROR, str(error))
                continue
            self._publish(state, rospy.Time.now(), 0.0 if before is None else now - before)
            before = now
            counted += 1
            rate = counted / (now - counted_at) if now > counted_at else 0.0
            if self._diagnostics.report(now, OK, f"{rate:.1f} readings/s"):
                counted, counted_at = 0, now

    def _publish(self, state: BodyState, stamp: rospy.Time, elapsed: float) -> None:
        self._publish_joints(state, stamp, elapsed)
        torso = imu_message(state.imu, "base_link", stamp)
        self._imus["imu"].publish(torso)
        self._imus["imu/torso"].publish(torso)
        self._imus["imu/base"].publish(imu_message(state.imu_base, "base_footprint", stamp))
        if self._use_odometry and all_finite(state.torso):
            self._publish_odometry(state, stamp)

    def _publish_joints(self, state: BodyState, stamp: rospy.Time, elapsed: float) -> None:
        message = JointState()
        message.header.stamp = stamp
        message.name = list(self._reader.joints)
        message.position = list(state.positions)
        message.velocity = list(state.velocities)
        message.effort = list(state.efforts)
        # The robot reports how fast its wheels turn, not how far: that is summed up here, from 0 at the start.
        for index, (wheel, speed) in enumerate(zip(WHEELS, state.wheel_speeds, strict=True)):
            if all_finite([speed]):
                self._wheel_angles[index] += speed * elapsed
                message.name.append(wheel)
                message.position.append(self._wheel_angles[index])
                message.velocity.append(speed)
                message.effort.append(float("nan"))
        self._joints.publish(message)

        stiffness = JointState()
        stiffness.header.stamp = stamp
        stiffness.name = list(self._reader.joints)
        stiffness.effort = state.stiffness
        self._stiffness.publish(stiffness)

    def _publish_odometry(self, state: BodyState, stamp: rospy.Time) -> None:
        torso = state.torso
        transform = TransformStamped()
        transform.header.stamp = stamp
        transform.header.frame_id = self._odom_frame
        transform.child_frame_id = "base_link"
        translation = transform.transform.translation
        translation.x, translation.y, translation.z = torso.x, torso.y, torso.z
        transform.transform.rotation = Quaternion(*quaternion(torso.roll, torso.pitch, torso.yaw))
        self._tf.publish(TFMessage([transform]))

        message = Odometry()
        message.header = transform.header
        message.child_frame_id = self._base_frame
        position = message.pose.pose.position
        message.pose.covariance = covariance(whole=self._base_frame != "base_footprint")
        message.twist.covariance = covariance()
        if self._base_frame == "base_footprint":
            position.x, position.y, theta = state.floor
            message.pose.pose.orientation = Quaternion(*quaternion(0.0, 0.0, theta))
        else:
            position.x, position.y, position.z = torso.x, torso.y, torso.z
            message.pose.pose.orientation = transform.transform.rotation
        twist = message.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = state.velocity
        self._odom.publish(message)


def imu_message(imu: body.Imu, frame: str, stamp: rospy.Time) -> Imu:
    """Return what an inertial sensor says in its frame."""
    message = Imu()
    message.header.stamp, message.header.frame_id = stamp, frame
    # sensor_msgs/Imu: -1 in the first element of a covariance says that there is no such measurement.
    if all_finite(imu.angles):
        message.orientation = Quaternion(*quaternion(*imu.angles))
    else:
        message.orientation_covariance[0] = -1
    if all_finite(imu.gyro):
        rate = message.angular_velocity
        rate.x, rate.y, rate.z = imu.gyro
    else:
        message.angular_velocity_covariance[0] = -1
    if all_finite(imu.acceleration):
        acceleration = message.linear_acceleration
        acceleration.x, acceleration.y, acceleration.z = imu.acceleration
    else:
        message.linear_acceleration_covariance[0] = -1
    return message


if __name__ == "__main__":
    sys.exit(JointStates().run())
