"""Driving over ROS as rows of a robot's table: who may drive (avatar_gui, node drive_lease), and stopping.

No ROS here."""

from __future__ import annotations

import math
from typing import Any

from gui.ros.channels import Answer, Incoming, Offered, Outgoing
from telepresence.security.outside_text import clean
from telepresence.teleop.lease_topics import (
    fill_ask,
    fill_command,
    fill_join,
    fill_look,
    read_asked,
    read_joined,
    read_lease_state,
)
from telepresence.teleop.looking import read_head_state

MOST_AXES = 64
"""Axes, and buttons, of a gamepad."""


def _read_joined(response: Any) -> Answer:
    return Answer(response.ok, clean(response.reason), read_joined(response))


def _read_asked(response: Any) -> Answer:
    return Answer(response.ok, clean(response.reason), read_asked(response))


def _read_text(message: Any, _arrived: float) -> str:
    return clean(message.data)


def _read_joy(message: Any, _arrived: float) -> tuple[tuple[float, ...], tuple[int, ...]]:
    axes = (max(-1.0, min(1.0, axis)) if math.isfinite(axis) else 0.0 for axis in message.axes[:MOST_AXES])
    return tuple(axes), tuple(message.buttons[:MOST_AXES])


def _leave_zero(_message: Any) -> None:
    """Change nothing: a new geometry_msgs/Twist is zero."""


JOY = Incoming("joy", "joy", "sensor_msgs/Joy", _read_joy, on_request=True, queue=100)
"""All that comes while Qt is not free, not the newest alone: a tap on the stop is over with the next message."""
HEAD = Incoming("head", "head/state", "telepresence_msgs/HeadState", read_head_state)
INCOMING = (
    Incoming("lease", "drive/state", "telepresence_msgs/DriveState", read_lease_state),
    JOY,
    Incoming("safety_text", "safety_state", "std_msgs/String", _read_text),
)
SERVICES = (
    Offered("join", "drive/join", "telepresence_msgs/DriveJoin", fill_join, _read_joined, timeout=3.0),
    Offered("ask", "drive/ask", "telepresence_msgs/DriveAsk", fill_ask, _read_asked, timeout=3.0),
    Offered("stop_drive", "stop_drive"),
    Offered("reset_stop", "reset_stop"),
)


def outgoing(cmd_vel: str) -> tuple[Outgoing, ...]:
    """Return rows for a robot that is driven by `cmd_vel`, to which the window itself sends nothing but zeros."""
    return (
        Outgoing("command", "drive/command", "telepresence_msgs/DriveCommand", fill_command),
        Outgoing("look", "drive/look", "telepresence_msgs/DriveLook", fill_look),
        Outgoing("zero", cmd_vel, "geometry_msgs/Twist", _leave_zero),
    )
