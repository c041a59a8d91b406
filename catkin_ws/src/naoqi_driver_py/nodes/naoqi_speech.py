#!/usr/bin/env python3
"""Lets the robot speak.

Subscribes: speech (std_msgs/String): say this.
Actions:    speech_action (naoqi_bridge_msgs/SpeechWithFeedback): say this and report when it is said; cancelling
            silences the robot.
Services:   naoqi_driver/set_language (SetString), naoqi_driver/get_language (GetString), for example "English".
"""

import sys

import actionlib
import rospy
from naoqi_bridge_msgs.msg import SpeechWithFeedbackAction, SpeechWithFeedbackFeedback
from naoqi_bridge_msgs.srv import GetString, GetStringResponse, SetString, SetStringResponse
from naoqi_driver.connection import RobotError
from naoqi_driver.naoqi_node import NaoqiNode
from naoqi_driver.replies import text
from std_msgs.msg import String
from telepresence_ros.node import hide_late_publications
from telepresence_ros.past_commands import subscribe_commands

POLL_PERIOD = 0.1


class Speech:
    def __init__(self) -> None:
        self._node = NaoqiNode("naoqi_speech")
        hide_late_publications()
        subscribe_commands("speech", String, self._on_speech, queue_size=10)
        rospy.Service("naoqi_driver/set_language", SetString, self._on_set_language)
        rospy.Service("naoqi_driver/get_language", GetString, self._on_get_language)
        self._action = actionlib.SimpleActionServer("speech_action", SpeechWithFeedbackAction, self._on_goal, False)
        self._action.start()

    def run(self) -> int:
        return self._node.run()

    def _on_speech(self, message: String) -> None:
        try:
            self._node.connection.call_async("ALTextToSpeech", "say", message.data)
        except RobotError as error:
            rospy.logwarn("not said: %s", error)

    def _on_goal(self, goal) -> None:
        try:
            saying = self._node.connection.call_async("ALTextToSpeech", "say", goal.say)
            while not saying.done:
                # again and again: actionlib's client drops what comes before it has noted that it sent the goal
                self._action.publish_feedback(SpeechWithFeedbackFeedback())
                if self._node.stop.wait(POLL_PERIOD):
                    return
                if self._action.is_preempt_requested():
                    self._node.connection.call("ALTextToSpeech", "stopAll")
                    self._action.set_preempted()
                    return
            saying.result()
            self._action.set_succeeded()
        except RobotError as error:
            self._action.set_aborted(text=str(error))

    def _on_set_language(self, request) -> SetStringResponse:
        try:
            self._node.connection.call("ALTextToSpeech", "setLanguage", request.data)
        except RobotError as error:
            rospy.logwarn("language stays: %s", error)
            return SetStringResponse(success=False)
        return SetStringResponse(success=True)

    def _on_get_language(self, _request) -> GetStringResponse:
        try:
            return GetStringResponse(text(self._node.connection.call("ALTextToSpeech", "getLanguage"), "getLanguage"))
        except RobotError as error:
            raise rospy.ServiceException(str(error)) from None


if __name__ == "__main__":
    sys.exit(Speech().run())
