#!/usr/bin/env python3
"""Moves and stiffens the robot's joints, while nobody presses the red stop.

Actions:    joint_trajectory, joint_stiffness_trajectory (naoqi_bridge_msgs/JointTrajectory),
            joint_angles_action (JointAnglesWithSpeed), body_pose_naoqi (BodyPoseWithSpeed: NAOqi's own postures).
Subscribes: joint_angles (JointAnglesWithSpeed), joint_stiffness (sensor_msgs/JointState, stiffness in the field effort;
            what naoqi_joint_states publishes under the same name is not taken as a command); the robot's
            drive/state (telepresence_msgs/DriveState, of drive_lease; see `robot_namespace`): while the red stop is
            pressed motions end, and new ones and wakeup are refused. To stiffen, to relax and to rest is always
            allowed.
Services:   body_stiffness/enable, body_stiffness/disable, wakeup, rest, life/enable, life/disable (std_srvs/Empty),
            life/get_state (std_srvs/Trigger). They answer when the robot has done it.
Publishes:  get_life_state (std_msgs/String, latched).
Parameters: ~poll_rate (0.2) [s] between two polls of a running motion; ~init_stiffness (0.0): above 0, stiffen the
            joints to this once at start; ~robot_namespace (""): see `robot_namespace`.
"""

import sys
import time
from collections.abc import Callable

import actionlib
import rospy
from naoqi_bridge_msgs.msg import (
    BodyPoseWithSpeedAction,
    BodyPoseWithSpeedResult,
    JointAnglesWithSpeed,
    JointAnglesWithSpeedAction,
    JointAnglesWithSpeedResult,
    JointTrajectoryAction,
    JointTrajectoryResult,
)
from naoqi_driver.body import MOST_JOINTS
from naoqi_driver.connection import PendingCall, RobotError
from naoqi_driver.naoqi_node import NaoqiNode
from naoqi_driver.replies import names as names_of
from naoqi_driver.replies import numbers, text
from naoqi_pose.robot_namespace import of_robot
from naoqi_pose.trajectory import Interpolation, UnusableTrajectory, to_interpolation
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Empty, EmptyResponse, Trigger, TriggerResponse
from telepresence_msgs.msg import DriveState
from telepresence_ros.node import hide_late_publications
from telepresence_ros.past_commands import subscribe_commands

from telepresence.security.outside_text import clean

SLOW_TIMEOUT = 15.0
"""Seconds that waking up, resting and a change of life may take."""
STIFFENING_TIME = 0.5
RESULT_TIMEOUT = 1.0
LIFE_PERIOD = 2.0
NO_STOP_AFTER = 10.0
"""Seconds without drive_lease, which may start later than we, after which it is said that there is no red stop."""


class PoseController:
    def __init__(self) -> None:
        self._node = NaoqiNode("pose_controller")
        hide_late_publications()
        self._poll = float(rospy.get_param("~poll_rate", 0.2))
        self._stiffen_to = float(rospy.get_param("~init_stiffness", 0.0))
        self._stopped_by = ""
        self._stop_seen, self._stop_missed = time.monotonic(), False
        self._states = rospy.Subscriber(
            of_robot("drive/state"), DriveState, self._on_drive_state, queue_size=1, tcp_nodelay=True
        )
        self._life = rospy.Publisher("get_life_state", String, queue_size=1, latch=True)
        for name, service, method, *arguments in (
            ("body_stiffness/enable", "ALMotion", "stiffnessInterpolation", "Body", 1.0, STIFFENING_TIME),
            ("body_stiffness/disable", "ALMotion", "stiffnessInterpolation", "Body", 0.0, STIFFENING_TIME),
            ("wakeup", "ALMotion", "wakeUp"),
            ("rest", "ALMotion", "rest"),
            ("life/enable", "ALAutonomousLife", "setState", "solitary"),
            ("life/disable", "ALAutonomousLife", "setState", "disabled"),
        ):
            rospy.Service(name, Empty, self._service(name, service, method, *arguments))
        rospy.Service("life/get_state", Trigger, self._on_get_life)
        self._servers = {
            name: actionlib.SimpleActionServer(name, action, execute, auto_start=False)
            for name, action, execute in (
                ("joint_trajectory", JointTrajectoryAction, self._on_trajectory),
                ("joint_stiffness_trajectory", JointTrajectoryAction, self._on_stiffness_trajectory),
                ("joint_angles_action", JointAnglesWithSpeedAction, self._on_angles_action),
                ("body_pose_naoqi", BodyPoseWithSpeedAction, self._on_body_pose),
            )
        }
        for server in self._servers.values():
            server.start()
        subscribe_commands("joint_angles", JointAnglesWithSpeed, self._on_angles, queue_size=10)
        subscribe_commands("joint_stiffness", JointState, self._on_stiffness, queue_size=10)

    def run(self) -> int:
        return self._node.run(self._loop)

    def _loop(self) -> None:
        for now in self._node.cycles(LIFE_PERIOD):
            self._look_for_the_stop(now)
            try:
                if self._stiffen_to > 0:
                    self._node.connection.call(
                        "ALMotion", "stiffnessInterpolation", "Body", min(self._stiffen_to, 1.0), STIFFENING_TIME
                    )
                    self._stiffen_to = 0.0
                self._life.publish(self._read_life())
            except RobotError as error:
                rospy.logdebug("%s", error)

    def _read_life(self) -> str:
        return text(self._node.connection.call("ALAutonomousLife", "getState"), "getState")

    # --- the red stop ------------------------------------------------------------------------------------------------

    def _on_drive_state(self, state: DriveState) -> None:
        self._stopped_by = clean(state.stopped_by)

    def _look_for_the_stop(self, now: float) -> None:
        """Say when nobody could press the red stop, or when it is another robot's that we listen for."""
        if self._states.get_num_connections() > 0:
            self._stop_seen, self._stop_missed = now, False
        elif not self._stop_missed and now - self._stop_seen > NO_STOP_AFTER:
            self._stop_missed = True
            rospy.logwarn(
                "no red stop holds the joints: nobody publishes %s. If this robot's is in another namespace, "
                "tell pose_manager.launch: robot_namespace:=/NAME",
                self._states.resolved_name,
            )

    @property
    def _is_stopped(self) -> bool:
        # What drive_lease has said counts as long as it is there.
        return bool(self._stopped_by) and self._states.get_num_connections() > 0

    def _require_no_stop(self) -> None:
        """Raises: RobotError: Somebody has pressed the red stop."""
        if self._is_stopped:
            raise RobotError(f"{self._stopped_by} has pressed the red stop")

    # --- topics ------------------------------------------------------------------------------------------------------

    def _on_angles(self, message: JointAnglesWithSpeed) -> None:
        method = "changeAngles" if message.relative else "setAngles"
        self._move("ALMotion", method, list(message.joint_names), list(message.joint_angles), message.speed)

    def _on_stiffness(self, message: JointState) -> None:
        if message._connection_header["callerid"].rpartition("/")[2] == "naoqi_joint_states":
            return
        self._call("ALMotion", "setStiffnesses", list(message.name), list(message.effort))

    def _move(self, *call) -> None:
        try:
            self._require_no_stop()
        except RobotError as error:
            rospy.logwarn_throttle(5.0, "joint_angles is not obeyed: %s", error)
        else:
            self._call(*call)

    def _call(self, *call) -> None:
        try:
            self._node.connection.call(*call)
        except RobotError as error:
            rospy.logwarn("%s", error)

    # --- services ----------------------------------------------------------------------------------------------------

    def _service(self, name: str, service: str, method: str, *arguments) -> Callable:
        def serve(_request) -> EmptyResponse:
            try:
                if method == "wakeUp":
                    self._require_no_stop()
                self._node.connection.call(service, method, *arguments, timeout=SLOW_TIMEOUT)
            except RobotError as error:
                raise rospy.ServiceException(f"{name}: {error}") from None
            return EmptyResponse()

        return serve

    def _on_get_life(self, _request) -> TriggerResponse:
        try:
            return TriggerResponse(True, self._read_life())
        except RobotError as error:
            return TriggerResponse(False, str(error))

    # --- actions -----------------------------------------------------------------------------------------------------

    def _on_trajectory(self, goal) -> None:
        self._interpolate("joint_trajectory", goal, "angleInterpolation", [goal.relative == 0], "getAngles", [True])

    def _on_stiffness_trajectory(self, goal) -> None:
        self._interpolate("joint_stiffness_trajectory", goal, "stiffnessInterpolation", [], "getStiffnesses", [])

    def _interpolate(self, name: str, goal, method: str, more: list, read_method: str, read_more: list) -> None:
        server, link = self._servers[name], self._node.connection
        try:
            interpolation = self._interpolation(goal.trajectory)
            joints = self._joints(interpolation.names)
            self._require_no_stop()
            motion = link.call_async("ALMotion", method, *interpolation, *more)
            done = self._wait(server, motion, "ALMotion", "killTasksUsingResources", joints)
            positions = numbers(link.call("ALMotion", read_method, joints, *read_more), len(joints), read_method)
        except (RobotError, UnusableTrajectory) as error:
            server.set_aborted(JointTrajectoryResult(), str(error))
            return
        self._finish(server, done, JointTrajectoryResult(joint_state(joints, positions)))

    def _on_angles_action(self, goal) -> None:
        server, link = self._servers["joint_angles_action"], self._node.connection
        names, angles = list(goal.joint_angles.joint_names), list(goal.joint_angles.joint_angles)
        try:
            joints = self._joints(names)
            if goal.joint_angles.relative:
                present = numbers(link.call("ALMotion", "getAngles", joints, True), len(joints), "getAngles")
                angles = [angle + change for angle, change in zip(present, angles, strict=True)]
            self._require_no_stop()
            motion = link.call_async("ALMotion", "angleInterpolationWithSpeed", names, angles, goal.joint_angles.speed)
            done = self._wait(server, motion, "ALMotion", "killTasksUsingResources", joints)
            positions = numbers(link.call("ALMotion", "getAngles", joints, True), len(joints), "getAngles")
        except (RobotError, ValueError) as error:
            server.set_aborted(JointAnglesWithSpeedResult(), str(error))
            return
        self._finish(server, done, JointAnglesWithSpeedResult(joint_state(joints, positions)))

    def _on_body_pose(self, goal) -> None:
        server = self._servers["body_pose_naoqi"]
        try:
            self._require_no_stop()
            motion = self._node.connection.call_async("ALRobotPosture", "goToPosture", goal.posture_name, goal.speed)
            done = self._wait(server, motion, "ALRobotPosture", "stopMove")
            reached = done and bool(motion.result(RESULT_TIMEOUT))
        except RobotError as error:
            server.set_aborted(BodyPoseWithSpeedResult(), str(error))
            return
        if done and not reached:
            server.set_aborted(BodyPoseWithSpeedResult(), f"the robot did not reach {goal.posture_name}")
        else:
            self._finish(server, done, BodyPoseWithSpeedResult())

    def _interpolation(self, trajectory) -> Interpolation:
        points = [(point.time_from_start.to_sec(), point.positions) for point in trajectory.points]
        return to_interpolation(trajectory.joint_names, points, self._joints_of)

    def _joints_of(self, group: str) -> list[str]:
        return names_of(self._node.connection.call("ALMotion", "getBodyNames", group), MOST_JOINTS, "getBodyNames")

    def _joints(self, names: list[str]) -> list[str]:
        """The joints that names of joints and groups stand for: what a motion takes is listed by joint."""
        body = self._joints_of("Body")
        return [joint for name in names for joint in ([name] if name in body else self._joints_of(name))]

    def _wait(self, server, motion: PendingCall, *end) -> bool:
        """Wait for the motion; False when the goal was withdrawn before, and the motion ended.

        Args:
            end: Service, method and arguments that end the motion. A robot whose methods know nothing of being
                cancelled goes on when only the call is given up.
        Raises:
            RobotError: It was refused or is lost, the robot does not say that it has ended it, or the red stop did.
        """
        while not motion.done:
            if self._is_stopped or server.is_preempt_requested() or self._node.stop.is_set():
                motion.cancel()
                self._node.connection.call(*end)
                self._require_no_stop()
                return False
            self._node.stop.wait(self._poll)
        motion.result(RESULT_TIMEOUT)
        return True

    @staticmethod
    def _finish(server, done: bool, result) -> None:
        if done:
            server.set_succeeded(result)
        else:
            server.set_preempted(result, "withdrawn")


def joint_state(names: list[str], positions: list[float]) -> JointState:
    message = JointState(name=names, position=positions)
    message.header.stamp = rospy.Time.now()
    return message


if __name__ == "__main__":
    sys.exit(PoseController().run())
