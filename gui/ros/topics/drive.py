"""Driving over ROS as rows of a robot's table: who may drive (avatar_gui, node drive_lease), and stopping.

No ROS here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from gui.ros.channels import Answer, Incoming, Offered, Outgoing
from telepresence.security.outside_text import clean, clean_name
from telepresence.security.signing import PROOF
from telepresence.teleop.drive_lease import Command, Velocity
from telepresence.teleop.key_agreement import Claim

MOST_PRESENT = 32
"""People that are shown."""
MOST_AXES = 64
"""Axes, and buttons, of a gamepad."""


@dataclass(frozen=True)
class LeaseState:
    """Who drives (telepresence_msgs/DriveState).

    Args:
        window: Node of the pilot's window.
        other: Node of another program that drives.
        present: (name with role, node) of everybody with a window.
        arrived: When the message arrived [monotonic s].
    """

    epoch: str
    sign_in: bool
    pilot: str
    window: str
    asking: str
    stopped_by: str
    hold: str
    other: str
    velocity: Velocity
    present: tuple[tuple[str, str], ...]
    arrived: float


def read_lease_state(message: Any, arrived: float) -> LeaseState:
    """Convert a telepresence_msgs/DriveState.

    Raises:
        ValueError: It names more people than windows, or fewer.
    """
    if len(message.present) != len(message.windows):
        raise ValueError(f"{len(message.present)} people have {len(message.windows)} windows")
    present = zip(message.present[:MOST_PRESENT], message.windows[:MOST_PRESENT], strict=True)
    return LeaseState(
        clean(message.epoch),
        message.sign_in,
        clean_name(message.pilot),
        clean(message.window),
        clean_name(message.asking),
        clean_name(message.stopped_by),
        clean(message.hold),
        clean_name(message.other),
        Velocity(message.vx, message.vy, message.wz),
        tuple((clean_name(name), clean(window)) for name, window in present),
        arrived,
    )


def fill_command(message: Any, session: str, command: Command) -> None:
    """Fill in a signed command of this window."""
    message.session, message.number, message.sent = session, command.number, command.sent
    message.driving = command.velocity is not None
    message.vx, message.vy, message.wz = command.velocity or (0.0, 0.0, 0.0)
    message.hold, message.proof = command.hold, command.proof


def _fill_join(request: Any, claim: Claim, session: str = "", proof: bytes = bytes(PROOF)) -> None:
    request.name, request.window, request.key = claim.name, claim.node, claim.key
    request.session, request.proof = session, proof


def _read_joined(response: Any) -> Answer:
    return Answer(response.ok, clean(response.reason), (response.session, bytes(response.key), bytes(response.proof)))


def _fill_ask(request: Any, session: str, number: int, action: str, to: str, proof: bytes) -> None:
    request.session, request.number, request.action, request.to, request.proof = session, number, action, to, proof


def _read_asked(response: Any) -> Answer:
    return Answer(response.ok, clean(response.reason), (response.ended, bytes(response.proof)))


def _read_text(message: Any, _arrived: float) -> str:
    return clean(message.data)


def _read_joy(message: Any, _arrived: float) -> tuple[tuple[float, ...], tuple[int, ...]]:
    axes = (max(-1.0, min(1.0, axis)) if math.isfinite(axis) else 0.0 for axis in message.axes[:MOST_AXES])
    return tuple(axes), tuple(message.buttons[:MOST_AXES])


def _leave_zero(_message: Any) -> None:
    """Change nothing: a new geometry_msgs/Twist is zero."""


JOY = Incoming("joy", "joy", "sensor_msgs/Joy", _read_joy, on_request=True)
INCOMING = (
    Incoming("lease", "drive/state", "telepresence_msgs/DriveState", read_lease_state),
    JOY,
    Incoming("safety_text", "safety_state", "std_msgs/String", _read_text),
)
SERVICES = (
    Offered("join", "drive/join", "telepresence_msgs/DriveJoin", _fill_join, _read_joined, timeout=3.0),
    Offered("ask", "drive/ask", "telepresence_msgs/DriveAsk", _fill_ask, _read_asked, timeout=3.0),
    Offered("stop_drive", "stop_drive"),
    Offered("reset_stop", "reset_stop"),
)


def outgoing(cmd_vel: str) -> tuple[Outgoing, ...]:
    """Return rows for a robot that is driven by `cmd_vel`, to which the window itself sends nothing but zeros."""
    return (
        Outgoing("command", "drive/command", "telepresence_msgs/DriveCommand", fill_command),
        Outgoing("zero", cmd_vel, "geometry_msgs/Twist", _leave_zero),
    )
