"""The values of the simulation guide's topic `movement_command`, for those who send them and those who act on them.

A window that drives a robot by velocities reports there what it does, so that `rostopic echo /movement_command` shows
it. Such a report must never drive: the velocities go through lease and safety gate, the report does not. Its publisher
says in its connection header that it only reports, and simulators ignore what comes over such a connection.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

REPORT_HEADER = {"report_only": "1"}
"""Fields of the connection header (TCPROS) of a publisher that reports and does not command."""


class Movement(IntEnum):
    """The values of the topic `movement_command`."""

    STOP = 0
    FORWARD = 1
    BACKWARD = 2


def movement_of(vx: float) -> Movement:
    """Return the movement that comes nearest to a forward velocity [m/s]; sideways and turning have none."""
    return Movement.FORWARD if vx > 0.0 else Movement.BACKWARD if vx < 0.0 else Movement.STOP


def only_reports(header: Mapping[str, str]) -> bool:
    """Return whether a message with this connection header is a report."""
    return all(header.get(name) == value for name, value in REPORT_HEADER.items())
