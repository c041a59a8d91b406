#!/usr/bin/env python3
"""Lets the robot take a pose: rosrun naoqi_pose execute_pose.py NAME

Exit code 0 when it was taken, 1 when not.
"""

import argparse
import sys

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from naoqi_bridge_msgs.msg import BodyPoseAction, BodyPoseGoal
from telepresence_ros.master_watch import wait_for_master

from telepresence.security.outside_text import clean

SERVER_TIMEOUT = 10.0
POSE_TIMEOUT = 30.0


def main() -> int:
    parser = argparse.ArgumentParser(prog="execute_pose.py", description="Let the robot take a pose.")
    parser.add_argument("pose", help="name of the pose, see config/pepper_poses.yaml")
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:])
    wait_for_master()
    rospy.init_node("execute_pose", anonymous=True)
    client = actionlib.SimpleActionClient("body_pose", BodyPoseAction)
    if not client.wait_for_server(rospy.Duration(SERVER_TIMEOUT)):
        print("nobody offers the action body_pose; is pose_manager running?", file=sys.stderr)
        return 1
    client.send_goal_and_wait(BodyPoseGoal(arguments.pose), rospy.Duration(POSE_TIMEOUT))
    if client.get_state() != GoalStatus.SUCCEEDED:
        print(f"pose not taken: {clean(client.get_goal_status_text()) or 'no answer'}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
