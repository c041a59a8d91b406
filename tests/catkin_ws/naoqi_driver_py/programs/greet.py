#!/usr/bin/env python3
"""Lets the robot say a sentence by the speech action, and waits until it is said."""

import sys

import actionlib
import rospy
from naoqi_bridge_msgs.msg import SpeechWithFeedbackAction, SpeechWithFeedbackGoal

rospy.init_node("greeter")
client = actionlib.SimpleActionClient("speech_action", SpeechWithFeedbackAction)
if not client.wait_for_server(rospy.Duration(20.0)):
    sys.exit("nobody speaks here")
begun = []
client.send_goal(SpeechWithFeedbackGoal(say=sys.argv[1]), feedback_cb=begun.append)
finished = client.wait_for_result(rospy.Duration(30.0))
print("begun:", bool(begun), "finished:", finished, "state:", client.get_goal_status_text() or client.get_state())
