#!/usr/bin/env python3
"""Named poses: takes the pose that an action names, by way of pose_controller's joint_trajectory.

Actions:    body_pose (naoqi_bridge_msgs/BodyPose).
Needs:      the action joint_trajectory of pose_controller; calls the robot's service stop_walk_srv first, where there
            is one (see `robot_namespace`).
Parameters: ~poses: name -> joint_names, positions, time_from_start (see config/pepper_poses.yaml). ~xap, Choregraphe's
            posture library for NAO, is not read: a warning says so. ~robot_namespace (""): see `robot_namespace`.
"""

import sys
import time

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from naoqi_bridge_msgs.msg import BodyPoseAction, BodyPoseResult, JointTrajectoryAction, JointTrajectoryGoal
from naoqi_pose.poses import Pose, UnusablePose, read_poses
from naoqi_pose.robot_namespace import of_robot
from std_srvs.srv import Empty
from telepresence_ros.node import Node, hide_late_publications
from trajectory_msgs.msg import JointTrajectoryPoint

CONTROLLER_TIMEOUT = 10.0
"""Seconds to wait for pose_controller."""
POLL_PERIOD = 0.1
GRACE = 5.0
"""Seconds a pose may take beyond its own time."""


class PoseManager:
    def __init__(self) -> None:
        self._node = Node("pose_manager")
        hide_late_publications()
        try:
            self._poses = read_poses(rospy.get_param("~poses", {}))
        except UnusablePose as error:
            sys.exit(f"{rospy.get_name()}: {error}")
        if rospy.get_param("~xap", ""):
            rospy.logwarn("posture libraries (~xap) are not read; write the poses to ~poses")
        self._stop_walk = rospy.ServiceProxy(of_robot("stop_walk_srv"), Empty)
        self._controller = actionlib.SimpleActionClient("joint_trajectory", JointTrajectoryAction)
        self._server = actionlib.SimpleActionServer("body_pose", BodyPoseAction, self._on_goal, auto_start=False)
        self._server.start()
        rospy.loginfo("poses: %s", ", ".join(sorted(self._poses)))

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._node.run()

    def _on_goal(self, goal) -> None:
        pose = self._poses.get(goal.pose_name)
        if pose is None:
            self._abort(f"there is no pose {goal.pose_name!r}; known: {', '.join(sorted(self._poses))}")
            return
        if not self._wait_for_controller():
            self._abort("pose_controller does not answer; is it running?")
            return
        self._stop_walking()
        self._controller.send_goal(trajectory_goal(pose))
        deadline = time.monotonic() + pose.points[-1][0] + GRACE
        while not self._controller.wait_for_result(rospy.Duration(POLL_PERIOD)):
            if self._server.is_preempt_requested() or self._node.stop.is_set():
                self._controller.cancel_goal()
                self._server.set_preempted(BodyPoseResult(), "withdrawn")
                return
            if time.monotonic() > deadline:
                self._controller.cancel_goal()
                self._abort(f"{goal.pose_name} took too long")
                return
        if self._controller.get_state() == GoalStatus.SUCCEEDED:
            self._server.set_succeeded(BodyPoseResult())
        else:
            self._abort(f"{goal.pose_name}: {self._controller.get_goal_status_text()}")

    def _abort(self, reason: str) -> None:
        rospy.logwarn("%s", reason)
        self._server.set_aborted(BodyPoseResult(), reason)

    def _wait_for_controller(self) -> bool:
        deadline = time.monotonic() + CONTROLLER_TIMEOUT
        while not self._controller.wait_for_server(rospy.Duration(POLL_PERIOD)):
            if self._node.stop.is_set() or self._server.is_preempt_requested() or time.monotonic() > deadline:
                return False
        return True

    def _stop_walking(self) -> None:
        try:
            self._stop_walk()
        except rospy.ServiceException as error:
            rospy.logdebug("nothing to stop: %s", error)


def trajectory_goal(pose: Pose) -> JointTrajectoryGoal:
    goal = JointTrajectoryGoal()
    goal.trajectory.joint_names = pose.joint_names
    goal.trajectory.points = [
        JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(time))
        for time, positions in pose.points
    ]
    return goal


if __name__ == "__main__":
    sys.exit(PoseManager().run())
