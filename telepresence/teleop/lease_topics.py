"""The messages of drive_lease on ROS (telepresence_msgs), read and written by field name: no ROS here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from telepresence.geometry import Velocity
from telepresence.security.outside_text import clean, clean_name
from telepresence.security.signing import PROOF
from telepresence.teleop.key_agreement import Claim
from telepresence.teleop.lease_messages import SignedCommand
from telepresence.teleop.looking import LookCommand

MOST_PRESENT = 32
"""People that are shown."""


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


def fill_command(message: Any, session: str, command: SignedCommand) -> None:
    """Fill in a signed command of this window."""
    message.session, message.number, message.sent = session, command.number, command.sent
    message.driving = command.velocity is not None
    message.vx, message.vy, message.wz = command.velocity or (0.0, 0.0, 0.0)
    message.hold, message.proof = command.hold, command.proof


def fill_look(message: Any, session: str, command: LookCommand) -> None:
    """Fill in where this window wants to look, signed."""
    message.session, message.number, message.sent = session, command.number, command.sent
    message.manner, message.yaw, message.pitch = command.look
    message.proof = command.proof


@dataclass(frozen=True)
class Joined:
    """What drive_lease answers to a window that wants to join (telepresence_msgs/DriveJoin).

    Args:
        key: The lease's fresh public key.
    """

    session: str
    key: bytes
    proof: bytes


@dataclass(frozen=True)
class Asked:
    """What drive_lease answers to a request (telepresence_msgs/DriveAsk), besides whether it did it."""

    ended: bool
    proof: bytes


def fill_join(request: Any, claim: Claim, session: str = "", proof: bytes = bytes(PROOF)) -> None:
    """Fill in the request to join; the first one, which asks for an offer, has neither session nor proof."""
    request.name, request.window, request.key = claim.name, claim.node, claim.key
    request.session, request.proof = session, proof


def read_joined(response: Any) -> Joined:
    """Convert the answer of drive/join."""
    return Joined(response.session, bytes(response.key), bytes(response.proof))


def fill_ask(request: Any, session: str, number: int, action: str, to: str, proof: bytes) -> None:
    """Fill in a signed request, see `telepresence.teleop.drive_lease.DriveLease.ask`."""
    request.session, request.number, request.action, request.to, request.proof = session, number, action, to, proof


def read_asked(response: Any) -> Asked:
    """Convert the answer of drive/ask."""
    return Asked(response.ended, bytes(response.proof))
