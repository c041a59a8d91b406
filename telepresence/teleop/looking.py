"""Where the pilot looks, as windows, drive_lease and the head's driver say it to each other. No ROS, no clock.

A look holds for `VALID`: whoever wants the head to go on turning repeats it. Yaw is positive to the left, pitch down.
"""

from __future__ import annotations

import enum
import math
import struct
from dataclasses import dataclass
from typing import Any, NamedTuple

from telepresence.security import signing
from telepresence.security.outside_text import clean

VALID = 0.3
"""Seconds for which a look counts. Windows repeat it every `SEND_PERIOD` of `telepresence.teleop.command_timeout`."""
HEAD_LIFE = 2.0
"""[s] for which what the driver says of the head is true; it says so twice a second at least."""


class Manner(enum.IntEnum):
    """What yaw and pitch of a look mean; the numbers are those of telepresence_msgs/HeadLook."""

    RATE = 1
    """Turn the head this fast [rad/s]."""
    GOAL = 2
    """Turn it to these angles [rad]."""
    AHEAD = 3
    """Straight ahead."""
    WAY = 4
    """Where the robot drives."""


class Look(NamedTuple):
    """Where the pilot wants to look."""

    manner: Manner
    yaw: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True)
class LookCommand:
    """A look as a window sends it.

    Args:
        number: Counts up, apart from those of driving.
        sent: The window's own clock [s].
    """

    number: int
    sent: float
    look: Look
    proof: bytes = b""


def read_look(manner: int, yaw: float, pitch: float) -> Look:
    """Return a look.

    Raises:
        ValueError: There is no such manner, or a number is not finite.
    """
    if not (math.isfinite(yaw) and math.isfinite(pitch)):
        raise ValueError("a look whose angles are no numbers")
    return Look(Manner(manner), yaw, pitch)


def sign_look(key: bytes, command: LookCommand) -> bytes:
    """Return the proof that belongs in the command."""
    return signing.sign(key, "look", command.number, look_part(command))


def look_part(command: LookCommand) -> bytes:
    """Return what of a look is signed besides its number."""
    return struct.pack("<dB2d", command.sent, *command.look)


@dataclass(frozen=True)
class HeadState:
    """Where the head points, and how far it turns (telepresence_msgs/HeadState). Yaw left, pitch down [rad].

    Args:
        left: Farthest yaw, to both sides.
        up, down: Farthest pitches at this yaw.
        ahead: Pitch of looking straight ahead.
        problem: Why the head cannot be turned; empty while it can.
        arrived: When the message arrived [monotonic s].
    """

    yaw: float
    pitch: float
    left: float
    up: float
    down: float
    ahead: float
    problem: str
    arrived: float


def read_head_state(message: Any, arrived: float) -> HeadState:
    """Convert a telepresence_msgs/HeadState.

    Raises:
        ValueError: No head has such angles.
    """
    angles = (message.yaw, message.pitch, message.left, message.up, message.down, message.ahead)
    if not all(math.isfinite(angle) and abs(angle) <= math.pi for angle in angles):
        raise ValueError("no head has such angles")
    return HeadState(*angles, clean(message.problem), arrived)
