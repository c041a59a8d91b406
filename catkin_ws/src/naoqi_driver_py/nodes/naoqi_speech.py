#!/usr/bin/env python3
"""Lets the robot speak.

Subscribes: speech (std_msgs/String): say this. Only while the robot is connected: whoever publishes sees that nobody
            listens (`get_num_connections`, `rostopic info`), and no sentence waits for the robot.
Actions:    speech_action (naoqi_bridge_msgs/SpeechWithFeedback): say this and report when it is said; cancelling
            silences the robot.
Services:   naoqi_driver/set_language (SetString), naoqi_driver/get_language (GetString), for example "English".
"""

import http.client
import sys
import xmlrpc.client

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
        self._subscription: rospy.Subscriber | None = None
        rospy.Service("naoqi_driver/set_language", SetString, self._on_set_language)
        rospy.Service("naoqi_driver/get_language", GetString, self._on_get_language)
        self._action = actionlib.SimpleActionServer("speech_action", SpeechWithFeedbackAction, self._on_goal, False)
        self._action.start()

    def run(self) -> int:
        return self._node.run(self._listen)

    def _listen(self) -> None:
        """Subscribe whenever the robot is connected, and only then."""
        for _ in self._node.cycles(POLL_PERIOD):
            connected = self._node.connection.connected
            if self._subscription is not None and not connected:
                self._subscription.unregister()
                self._subscription = None
            elif self._subscription is None and connected and self._node.master.alive:
                try:
                    # Anew each time: what a latched publisher repeats was said to nobody, and is past.
                    self._subscription = subscribe_commands("speech", String, self._on_speech, queue_size=10)
                except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
                    rospy.logdebug("not subscribed yet: %s", error)  # the master has just ended; its watch reports it

    def _on_speech(self, message: String) -> None:
        try:
            saying = self._node.connection.call_async("ALTextToSpeech", "say", message.data)
        except RobotError as error:
            self._not_said(error)
        else:
            saying.on_failure(self._not_said)

    def _not_said(self, error: RobotError) -> None:
        if not self._node.stop.is_set():
            rospy.logwarn("not said, or not to its end: %s", error)

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
