"""What has failed, as one sentence for the pilot: the cause, not what follows from it. No ROS, no Qt.

Two sources: what the window notices itself (`Faults.notice`), because ROS cannot say it, and what those who restart
programs report (`Faults.report`; topic /station/faults). A report makes the sentence of the same cause exact.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection
from dataclasses import dataclass
from enum import IntEnum

DRIVE_SERVER = "The drive server"
"""How a link says what is wrong begins, and the reason of a fault for that."""
UNREACHABLE = "robot unreachable"
"""How the drivers' `drive_state` begins when they have no robot."""
SILENT_AFTER = 0.6
"""[s] without a word from who speaks 20 times a second, or without a new picture, after which window and page say
so."""
OLDEST_REPORT = 5.0
"""[s]; the first report may be one that was kept for newcomers: an older one is none of now."""
SHOWN_TIME = 3.0
"""[s] for which a report is shown when the window notices nothing itself."""
LEAST_TIME = 1.5
"""[s] for which a sentence can be read, however soon it is over."""
HOPE_TIME = 20.0
"""[s] after which a fault that is not over is not waited for any more: the window says what to press instead."""
CONSEQUENCE_TIME = 2.5
"""[s] after which another fault is not what followed from this one."""
REMEMBERED = 8
"""Sentences that can be read afterwards."""


class Cause(IntEnum):
    """What a fault is about. An earlier one explains the later ones."""

    MASTER = 1
    SIMULATION = 2
    LINK = 3
    DRIVER = 4
    LEASE = 5
    PICTURE = 6
    TERMINAL = 7
    STATION = 8
    OTHER = 9

    @property
    def stops(self) -> bool:
        """Whether it stops the robot."""
        return self <= Cause.PICTURE


NOTICED = {
    Cause.MASTER: "The ROS master does not answer: the robot stays stopped until it is back.",
    Cause.SIMULATION: "No word from the simulated robot: it is gone until its program has started again.",
    Cause.LINK: "{robot} does not answer: it has stopped by itself; waiting for it.",
    Cause.DRIVER: "The program that drives {robot} is silent: the robot stays stopped until it is back.",
    Cause.LEASE: "The program that decides who drives is silent: the robot stays stopped until it is back.",
    Cause.PICTURE: "No new picture from the camera: the robot stays stopped until one comes.",
    Cause.STATION: "The program that watches the others (roslaunch) is gone: they go on unwatched.",
}
"""What the window says when it notices it itself."""
PROGRAMS = {
    "rosmaster": ("The ROS master", Cause.MASTER),
    "roscore": ("The ROS master", Cause.MASTER),
    "robot_control_node": ("The simulated robot", Cause.SIMULATION),
    "drive_server": ("{robot}'s drive server", Cause.LINK),
    "onboard_drive": ("{robot}'s drive server", Cause.LINK),
    "naoqi_driver": ("The program that drives {robot}", Cause.DRIVER),
    "rto_core": ("The program that drives {robot}", Cause.DRIVER),
    "rto_drive_link": ("The program that drives {robot}", Cause.DRIVER),
    "safe_omni_drive": ("The safety gate", Cause.DRIVER),
    "drive_lease": ("The program that decides who drives", Cause.LEASE),
    "front": ("The front camera's program", Cause.PICTURE),
    "bottom": ("The floor camera's program", Cause.PICTURE),
    "depth": ("The depth camera's program", Cause.PICTURE),
    "rto_camera": ("The camera program", Cause.PICTURE),
    "rto_camera_receiver": ("The camera program", Cause.PICTURE),
    "onboard_camera": ("The camera program on the robot", Cause.PICTURE),
    "roslaunch": ("The program that watches the others (roslaunch)", Cause.STATION),
    "window terminal": ("The terminal of this window", Cause.TERMINAL),
    "window terminal reaper": ("The helper that closes this terminal", Cause.OTHER),
    "window terminal program": ("A program in the terminal", Cause.OTHER),
    "gui_ros_node": ("This window", Cause.OTHER),
    "stack up": ("The program that runs the station (stack up)", Cause.STATION),
    "fork_server": ("The program that starts the others (fork_server)", Cause.OTHER),
    "rosout": ("The program that gathers the logs", Cause.OTHER),
    "Xvfb": ("The display of this window", Cause.OTHER),
    "screen_page": ("The program that shows this window on a web page", Cause.OTHER),
    "rto_odometry": ("The odometry's program", Cause.OTHER),
    "naoqi_joint_states": ("The program of joints and odometry", Cause.OTHER),
    "pepper_laser": ("The laser's program", Cause.OTHER),
    "rto_laser": ("The laser's program", Cause.OTHER),
    "pepper_sonar": ("The sonar's program", Cause.OTHER),
    "com_cam": ("The tablet page's program", Cause.OTHER),
    "voice": ("The sound program", Cause.OTHER),
    "rto_voice": ("The sound program", Cause.OTHER),
    "onboard_sound": ("The sound program on the robot", Cause.OTHER),
}
"""Last part of a node's name -> what a pilot calls it, and what its fault is."""
SHARED = frozenset(
    {
        "rosmaster",
        "roscore",
        "roslaunch",
        "robot_control_node",
        "gui_ros_node",
        "window terminal",
        "window terminal reaper",
        "window terminal program",
        "stack up",
        "fork_server",
        "rosout",
        "Xvfb",
        "screen_page",
    }
)
"""Programs of all robots, whatever namespace they are in."""


@dataclass
class Fault:
    """A sentence that was shown.

    Args:
        since: When it began [monotonic s].
    """

    cause: Cause
    sentence: str
    since: float


class Faults:
    """The faults of one robot and of the station. Times are monotonic [s].

    Args:
        robot: What the robot is called.
        namespace: Of its topics; `/` for a robot without one.
        others: Namespaces of other robots.
    """

    def __init__(self, robot: str, namespace: str, others: Collection[str] = ()) -> None:
        self._robot, self._namespace, self._others = robot, namespace.rstrip("/"), tuple(others)
        self.picture_programs: Collection[str] = ()
        """Last parts of the names of the nodes that the shown pictures come from."""
        self._noticed: dict[Cause, float] = {}
        """Time since which the window notices it."""
        self._began: dict[Cause, float] = {}
        """When the window has last noticed that it began."""
        self._reports: dict[Cause, tuple[str, float]] = {}
        self.recent: deque[Fault] = deque(maxlen=REMEMBERED)
        """What was shown, oldest first."""

    def notice(self, cause: Cause, present: bool, now: float) -> None:
        """Take what the window notices itself, again and again."""
        if not present and cause in self._noticed:
            del self._noticed[cause]
            self._reports.pop(cause, None)  # over
        elif present and cause not in self._noticed:
            self._noticed[cause] = self._began[cause] = now

    def report(self, program: str, what: str, then: str, now: float) -> Cause | None:
        """Take a report: the node's name, "died: signal 9" or "froze", and "starts again" or "stays away".

        Returns:
            What it is about; None if about another robot.
        """
        name = program.rpartition("/")[2]
        if name not in SHARED and not self._owns(program):
            return None
        subject, cause = PROGRAMS.get(name, (f"The program {name}", Cause.OTHER))
        if cause is Cause.PICTURE and name not in self.picture_programs:
            cause = Cause.OTHER  # of a camera that nobody looks through
        kind, _, detail = what.partition(": ")
        sentence = f"{subject.format(robot=self._robot)} {kind}{f' ({detail})' if detail else ''}; it {then}."
        self._reports[cause] = (f"{sentence} The robot stops." if cause.stops else sentence, now)
        return cause

    def forget(self) -> None:
        """Show nothing: what ends now is meant to."""
        self._noticed.clear()
        self._began.clear()
        self._reports.clear()

    def current(self, now: float) -> Fault | None:
        """Return what to show now; None when nothing has failed."""
        cause = min((cause for cause in Cause if self._is_active(cause, now)), default=None)
        if cause is None:
            return None
        text, reported = self._reports.get(cause, ("", -math.inf))
        began = self._began.get(cause, -math.inf)
        if text and reported > began - CONSEQUENCE_TIME:  # both are about the same
            fault = Fault(cause, text, min(began, reported) if reported - began < HOPE_TIME else reported)
        else:
            fault = Fault(cause, NOTICED[cause].format(robot=self._robot), began)
        self._remember(fault)
        return fault

    def _owns(self, program: str) -> bool:
        inside = program.startswith(f"{self._namespace}/")
        return inside and not any(program.startswith(f"{other}/") for other in self._others)

    def _is_active(self, cause: Cause, now: float) -> bool:
        if cause in self._noticed and now - self._noticed[cause] < HOPE_TIME:
            return True
        reported = self._reports.get(cause, ("", -math.inf))[1]
        return now < max(self._began.get(cause, -math.inf) + LEAST_TIME, reported + SHOWN_TIME)

    def _remember(self, fault: Fault) -> None:
        for index, known in enumerate(self.recent):
            if abs(fault.since - known.since) <= CONSEQUENCE_TIME:
                if fault.cause <= known.cause:
                    self.recent[index] = fault  # that was a consequence, or the sentence has become exact
                return
        self.recent.append(fault)
