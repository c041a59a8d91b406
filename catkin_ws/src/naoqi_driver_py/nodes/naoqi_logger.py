#!/usr/bin/env python3
"""Repeats what NAOqi logs on /rosout.

Parameters: ~level (warning): the least important messages to repeat: fatal, error, warning, info, verbose or debug.

At most one line a second: what comes faster is counted, not written.

Wire: `LogManager.getListener()` returns an object whose signal `onLogMessage` carries, as a structure, source, level
(1 fatal to 6 debug), category, location and text, and from some robots a time between them. An old robot that refuses
the signal is asked again at the next link.
"""

import sys
import threading
import time
from typing import Any

import rospy
from naoqi_driver.connection import RobotError
from naoqi_driver.naoqi_node import NaoqiNode
from naoqi_driver.replies import UnexpectedReply, number, text

from telepresence.robot_side.naoqi_values import error_text
from telepresence.security.outside_text import clean

LEVELS = {"fatal": 1, "error": 2, "warning": 3, "info": 4, "verbose": 5, "debug": 6}
ROS_LOG = {1: rospy.logfatal, 2: rospy.logerr, 3: rospy.logwarn, 4: rospy.loginfo, 5: rospy.logdebug, 6: rospy.logdebug}
QUIET_PERIOD = 1.0
LINE_PERIOD = 1.0
"""Seconds between two lines."""
LONGEST_CATEGORY, LONGEST_LINE = 80, 400
"""Characters that are repeated."""


class Logger:
    def __init__(self) -> None:
        self._node = NaoqiNode("nao_logger")
        level = rospy.get_param("~level", "warning")
        if level not in LEVELS:
            sys.exit(f"{rospy.get_name()}: ~level is {level!r}; known: {', '.join(LEVELS)}")
        self._level = LEVELS[level]
        self._listener = None
        self._link = 0
        self._lock = threading.Lock()
        self._due = 0.0
        self._missed = 0

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
            rospy.logwarn("this robot does not share its log: %s", clean(error_text(error, LONGEST_LINE), LONGEST_LINE))

    def _on_message(self, message: Any) -> None:
        """Called on any thread, as often as the robot likes."""
        try:
            level, category, words = read_message(message)
        except UnexpectedReply:
            level, category, words = self._level, "its log", "holds an invalid line"
        if level > self._level:
            return
        with self._lock:
            now = time.monotonic()
            if now < self._due:
                self._missed += 1
                return
            missed, self._missed, self._due = self._missed, 0, now + LINE_PERIOD
        more = f" ({missed} lines left out)" if missed else ""
        ROS_LOG.get(level, rospy.logdebug)("NAOqi: %s: %s%s", category, words, more)


def read_message(message: Any) -> tuple[int, str, str]:
    """Level, category and text of a log message, which is a structure: a dict, or an object with attributes.

    Raises:
        UnexpectedReply: It is no such message.
    """
    if not isinstance(message, dict):
        message = {name: getattr(message, name, None) for name in ("level", "category", "message")}
    return (
        int(number(message.get("level"), "level of a log message")),
        text(message.get("category"), "category of a log message", LONGEST_CATEGORY),
        text(message.get("message"), "text of a log message", LONGEST_LINE).strip(),
    )


if __name__ == "__main__":
    sys.exit(Logger().run())
