"""What is published about the station's programs, as rows of a robot's table. No ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gui.ros.channels import Incoming
from telepresence.security.outside_text import clean, clean_name

LONGEST = 80
"""Characters of what happened, and of what comes next."""


@dataclass(frozen=True)
class FaultReport:
    """A program died or froze (telepresence_msgs/Fault).

    Args:
        stamp: When [s since 1970], by the clock of the station.
        program: Its node's name, or roslaunch, or rosmaster.
        what: "died: signal 9" or "froze".
        then: "starts again" or "stays away".
    """

    stamp: float
    program: str
    what: str
    then: str
    arrived: float


def read_fault(message: Any, arrived: float) -> FaultReport:
    """Convert a telepresence_msgs/Fault."""
    what, then = clean(message.what, LONGEST), clean(message.next, LONGEST)
    return FaultReport(message.stamp.to_sec(), clean_name(message.program), what, then, arrived)


FAULTS = Incoming("faults", "/station/faults", "telepresence_msgs/Fault", read_fault, queue=20)
