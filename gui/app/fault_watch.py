"""Notices what has failed around the window, and says it in one place: the banner under the picture.

What ROS reports (/station/faults) comes as it is. What ROS cannot say, the window sees itself: who used to speak and is
silent, and whether master, supervisor and robot answer.
"""

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, pyqtSignal

from gui.periodic_timer import PeriodicTimer
from gui.robots import ROBOTS
from gui.ros.readings import DriveState, Safety
from gui.ros.topics.station import FaultReport
from telepresence.station.fault_sentences import (
    DRIVE_SERVER,
    OLDEST_REPORT,
    SILENT_AFTER,
    UNREACHABLE,
    Cause,
    Fault,
    Faults,
)

if TYPE_CHECKING:
    from gui.driving.drive_access import DriveAccess
    from gui.ros.link import RosLink
    from gui.widgets.video_view import VideoView

PERIOD = 100
"""[ms] between two looks."""
PAUSED = 0.4
"""[s]; a look that comes later than this says that the window itself was held up, not that others are silent."""

SETTLED = 1.0
"""[s] for which the robot must have answered every program that has spoken, before it can fail to: at the start of a
station a drive server without a fault may speak before a driver that still waits for the robot."""
TAKEN_ALONG = 5.0
"""[s] for which a roslaunch that is gone is one that ran in the terminal which has just died."""


class FaultWatch(QObject):
    """Watches one robot and its station.

    Args:
        link, access: The robot, and who drives it.
        video: Its picture.
    """

    changed = pyqtSignal()
    """`fault` has changed."""

    def __init__(self, link: RosLink, access: DriveAccess, video: VideoView) -> None:
        super().__init__(video)
        self._link, self._access, self._video = link, access, video
        robot = link.robot
        others = {other.namespace for other in ROBOTS.values()} - {robot.namespace, "/"}
        self._faults = Faults(robot.title, robot.namespace, others)
        self.fault: Fault | None = None
        """What is shown now."""
        self._worked: set[Cause] = set()
        """What has worked since it was last meant to end: only that can fail."""
        self._spoke: dict[Cause, float] = {}
        self._answers: dict[str, bool] = {}
        """Program that answers for the robot (driver or drive server) -> whether the robot answers it."""
        self._answers_since = math.inf
        self._paused = True
        self._newest: tuple[float, str] | None = None
        self._looked_at = 0.0
        self._terminal_failed = -math.inf
        for name, take in (
            ("faults", self._on_report), ("true_pose", lambda _pose: self._speaks(Cause.SIMULATION)),
            ("safety", self._on_safety), ("drive_state", self._on_drive_state),
        ):  # fmt: skip
            if link.has(name):
                link.channel(name).arrived.connect(take)
        self._looks = PeriodicTimer(PERIOD, self.poll, self)
        self._looks.start()

    @property
    def recent(self) -> deque[Fault]:
        """What was shown, oldest first."""
        return self._faults.recent

    def set_paused(self, paused: bool) -> None:
        """Nobody is signed in, or the pilot ends the robot's programs: that they fall silent is no fault."""
        self._paused = paused
        if paused:
            self._worked.clear()
            self._spoke.clear()
            self._answers.clear()
            self._faults.forget()
            self.poll()

    def report(self, program: str, what: str, then: str) -> None:
        """Take a fault that the window itself has noticed, in the words of those that ROS reports."""
        if self._paused:
            return
        now = time.monotonic()
        if self._faults.report(program, what, then, now) is Cause.TERMINAL:
            self._terminal_failed = now
        self.poll()

    def poll(self) -> None:
        """Look at everything that can be silent."""
        now = time.monotonic()
        late, self._looked_at = now - self._looked_at > PAUSED, now
        if late:
            return  # what has arrived meanwhile is still to be read
        if not self._paused:
            self._notice(now)
        fault = self._faults.current(now)
        before = self.fault.sentence if self.fault else ""
        self.fault = fault
        if before != (fault.sentence if fault else ""):
            self.changed.emit()

    def _notice(self, now: float) -> None:
        working = {
            Cause.MASTER: self._link.state.master,
            Cause.LINK: bool(self._answers) and all(self._answers.values()),
            Cause.PICTURE: not (self._video.late and self._video.age() > SILENT_AFTER),
        }
        for cause in (Cause.SIMULATION, Cause.DRIVER):
            working[cause] = cause in self._spoke and now - self._spoke[cause] < SILENT_AFTER
        if self._access.shared:
            working[Cause.LEASE] = self._access.state is not None
        if self._link.state.master:  # without one nobody finds a supervisor that is back
            working[Cause.STATION] = not self._link.state.unsupervised
            if now - self._terminal_failed < TAKEN_ALONG:
                self._worked.discard(Cause.STATION)  # what it ran, a keyboard's roslaunch for one, ended with it
        self._answers_since = min(self._answers_since, now) if working[Cause.LINK] else math.inf
        for cause, works in working.items():
            if works and (cause is not Cause.LINK or now - self._answers_since >= SETTLED):
                self._worked.add(cause)
            self._faults.notice(cause, not works and cause in self._worked, now)

    def _speaks(self, cause: Cause) -> None:
        now = time.monotonic()
        if now - self._spoke.get(cause, now) > SILENT_AFTER:
            self._link.look_now()  # it has come back
        self._spoke[cause] = now

    def _on_safety(self, safety: Safety) -> None:
        self._speaks(Cause.DRIVER)
        self._answers["server"] = not (safety.state == "fault" and safety.reason.startswith(DRIVE_SERVER))

    def _on_drive_state(self, state: DriveState) -> None:
        self._answers["driver"] = not state.text.startswith(UNREACHABLE)

    def _on_report(self, report: FaultReport) -> None:
        known, self._newest = self._newest, (report.stamp, report.program)
        kept = time.time() - report.stamp > OLDEST_REPORT if known is None else known == self._newest
        if kept or self._paused:
            return
        self._faults.picture_programs = {*self._link.feed.split("/"), *self._link.robot.picture_programs}
        cause = self._faults.report(report.program, report.what, report.then, report.arrived)
        if cause is Cause.PICTURE:
            self._video.lose_source()
        self.poll()
