#!/usr/bin/env python3
"""Repeats what NAOqi logs on /rosout.

Parameters: ~level (warning): the least important messages to repeat: fatal, error, warning, info, verbose or debug.

Wire: `LogManager.getListener()` returns an object whose signal `onLogMessage` carries, as a structure, source, level
(1 fatal to 6 debug), a time, category, location and text. An old robot that refuses the signal is asked again at the
next link.
"""

import sys
from typing import Any

import rospy
from naoqi_driver.connection import RobotError
from naoqi_driver.naoqi_node import NaoqiNode

LEVELS = {"fatal": 1, "error": 2, "warning": 3, "info": 4, "verbose": 5, "debug": 6}
ROS_LOG = {1: rospy.logfatal, 2: rospy.logerr, 3: rospy.logwarn, 4: rospy.loginfo, 5: rospy.logdebug, 6: rospy.logdebug}
QUIET_PERIOD = 1.0


class Logger:
    def __init__(self) -> None:
        self._node = NaoqiNode("nao_logger")
        level = rospy.get_param("~level", "warning")
        if level not in LEVELS:
            sys.exit(f"{rospy.get_name()}: ~level is {level!r}; known: {', '.join(LEVELS)}")
        self._level = LEVELS[level]
        self._listener = None
        self._link = 0

    def run(self) -> int:
        return self._node.run(self._loop)

    def _loop(self) -> None:
        for _ in self._node.cycles(QUIET_PERIOD):
            if self._node.connection.connected and self._link != self._node.connection.connections:
                self._link = self._node.connection.connections
                self._listen()

    def _listen(self) -> None:
        try:
            listener = self._node.connection.call("LogManager", "getListener")
            # The object must stay referenced, or the robot forgets it.
            listener.onLogMessage.connect(self._on_message)
            self._listener = listener
        except (RobotError, RuntimeError, AttributeError) as error:
            rospy.logwarn("this robot does not share its log: %s", str(error).splitlines()[0])

    def _on_message(self, message) -> None:
        level, category, text = read_message(message)
        if level <= self._level:
            ROS_LOG.get(level, rospy.logdebug)("NAOqi: %s: %s", category, text.strip())


def read_message(message: Any) -> tuple[int, str, str]:
    """Level, category and text of a log message; libqi hands a structure over as a dict, or as an object with
    attributes."""
    if isinstance(message, dict):
        return int(message["level"]), str(message["category"]), str(message["message"])
    return int(message.level), str(message.category), str(message.message)


if __name__ == "__main__":
    sys.exit(Logger().run())
