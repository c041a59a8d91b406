#!/usr/bin/env python3
"""Gives the goal named, withdraws it when the robot is on its way, and prints how it ended.

    withdrawn_goal.py URL GOAL [--wait]

With --wait it is left to somebody else to end it.
"""

import sys
import time

import actionlib
import rospy
from naoqi_bridge_msgs.msg import (
    BodyPoseWithSpeedAction,
    BodyPoseWithSpeedGoal,
    JointAnglesWithSpeed,
    JointAnglesWithSpeedAction,
    JointAnglesWithSpeedGoal,
    JointTrajectoryAction,
    JointTrajectoryGoal,
)
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from telepresence import naoqi


def over_a_minute(names, value):
    point = JointTrajectoryPoint(positions=[value], time_from_start=rospy.Duration(60.0))
    return JointTrajectoryGoal(trajectory=JointTrajectory(joint_names=names, points=[point]))


slowly = JointAnglesWithSpeed(joint_names=["HeadYaw"], joint_angles=[1.5], speed=0.005)
GOALS = {
    "joint_trajectory": (JointTrajectoryAction, over_a_minute(["HeadYaw"], 1.5)),
    "joint_trajectory of a chain": (JointTrajectoryAction, over_a_minute(["Head"], 0.3)),
    "joint_stiffness_trajectory": (JointTrajectoryAction, over_a_minute(["HeadYaw"], 0.5)),
    "joint_angles_action": (JointAnglesWithSpeedAction, JointAnglesWithSpeedGoal(joint_angles=slowly)),
    "body_pose_naoqi": (BodyPoseWithSpeedAction, BodyPoseWithSpeedGoal(posture_name="Crouch", speed=0.05)),
}

rospy.init_node("undecided")
robot = naoqi.Session()
robot.connect(sys.argv[1])
motion = robot.service("ALMotion")
action, goal = GOALS[sys.argv[2]]
client = actionlib.SimpleActionClient(sys.argv[2].split()[0], action)
if not client.wait_for_server(rospy.Duration(20.0)):
    sys.exit("nobody takes such goals")
client.send_goal(goal)
deadline = time.monotonic() + 10.0
while not motion.getTaskList():
    if time.monotonic() > deadline:
        sys.exit("the robot does not move")
    time.sleep(0.05)
print("the robot moves", flush=True)
if "--wait" not in sys.argv:
    client.cancel_goal()
client.wait_for_result(rospy.Duration(20.0))
print("state:", client.get_state(), client.get_goal_status_text())
