"""Keeps one of the robot's activities in focus, so that its autonomous life starts none that takes the tablet away.

Wire (NAOqi 2.8 documentation, ALAutonomousLife, and of ref/life state_machine_management): `focusedActivity()` -> the
activity in focus or ""; `getState()` -> "solitary", "interactive", "safeguard" or "disabled"; `switchFocus(
"package/behaviour")` stops the activity in focus and starts this one, an error when no such activity is installed, or
while life is disabled: then nothing can be in focus, and nothing takes the tablet either. An interactive activity makes
a life that was solitary interactive. `stopFocus()` ends the one in focus.
"""

from __future__ import annotations

import logging
import time

from naoqi_driver.connection import Connection, RobotError

from telepresence_1.retry import Retry

log = logging.getLogger(__name__)

ACTIVITY = "robotvideo/behaviour"
"""The activity of the report's own package, `robotvideo.pkg`; see docs/pepper.md for how to install ours."""
NO_ACTIVITY = "none"
"""On a command line, where ROS drops an argument without a value."""
SWITCH_TIMEOUT = 5.0
"""Seconds that the robot may take to end one activity and to start another."""
END_TIMEOUT = 0.5
"""Seconds allowed for each call at the end: a program that ends does not wait for a robot that is gone."""
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0
"""Seconds between two attempts to take the focus."""


class RobotFocus:
    """The robot's focus for `activity`; "none" or "" leaves it alone. The methods belong to one thread at a time."""

    def __init__(self, connection: Connection, activity: str = ACTIVITY) -> None:
        self.activity = "" if activity == NO_ACTIVITY else activity
        self.held = False
        """Whether the robot says that the activity is in focus."""
        self.problem = ""
        """Why it is not, for people; "" when it is, or when nobody needs it."""
        self.needless = False
        """Whether it is not, and need not be, because autonomous life is off."""
        self._connection = connection
        self._retry = Retry(FIRST_PAUSE, LONGEST_PAUSE)

    def keep(self) -> None:
        """Take the focus unless the robot says that it is held, or that it does not live; what goes wrong is told in
        `problem`."""
        if not self.activity:
            return
        try:
            if self._connection.call("ALAutonomousLife", "focusedActivity") != self.activity:
                held, self.held = self.held, False
                if self._connection.call("ALAutonomousLife", "getState") == "disabled":
                    if not self.needless:
                        log.info("autonomous life is off: nothing takes the tablet, and no activity can be in focus")
                    self.needless, self.problem = True, ""
                    return
                self.needless = False
                if held:
                    log.warning("another activity has taken the robot's focus; taking it again")
                if not self._retry.due(time.monotonic()):
                    return
                self._connection.call("ALAutonomousLife", "switchFocus", self.activity, timeout=SWITCH_TIMEOUT)
        except RobotError as error:
            self.held = self.needless = False
            problem = str(error).rpartition("switchFocus: ")[2]
            if problem != self.problem:
                log.warning("without the robot's focus, whose autonomous life may take the tablet: %s", problem)
                self.problem = problem
            return
        self.held, self.needless, self.problem = True, False, ""

    def give_back(self) -> None:
        """End the activity if it is in focus; one that somebody else has put there stays."""
        if not self.held:
            return
        self.held = False
        try:
            if self._connection.call("ALAutonomousLife", "focusedActivity", timeout=END_TIMEOUT) == self.activity:
                self._connection.call("ALAutonomousLife", "stopFocus", timeout=END_TIMEOUT)
        except RobotError as error:
            log.warning("the robot keeps the focus: %s", error)
