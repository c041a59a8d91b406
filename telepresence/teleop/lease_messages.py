"""What windows and drive_lease send each other, and how it is signed. See `telepresence.teleop.drive_lease`."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import NamedTuple

from telepresence.geometry import ZERO_VELOCITY as ZERO
from telepresence.geometry import Velocity
from telepresence.security import signing
from telepresence.teleop.key_agreement import OPEN, Credential

PILOT, WATCHER = "pilot", "watcher"
MOST_TEXT = 200
"""Longest text of a window that is shown to others [characters]."""


@dataclass(frozen=True)
class Account:
    """A person who may join. A pilot of higher rank may take the robot from another one.

    Args:
        public: Key that follows from the password [32 bytes]; by default everybody's, for where names are not checked.
        credential: With which the person's own window joins.
    """

    name: str
    role: str
    rank: int = 0
    public: bytes = OPEN.lease
    credential: Credential = field(default=OPEN, repr=False, compare=False)


def outranks(account: Account, other: Account) -> bool:
    """Return whether what one person has done may be undone by another: any pilot ranks above a watcher."""
    if account.role != other.role:
        return account.role == PILOT
    return account.rank > other.rank


@dataclass(frozen=True)
class SignedCommand:
    """What a window sends: 20 times a second while it drives (`SEND_PERIOD` of `telepresence.teleop.command_timeout`),
    four times otherwise.

    Args:
        number: Counts up.
        sent: The window's own clock [s].
        velocity: None while no control is held.
        hold: Why nobody should drive by this window now, a picture that is lost for example; empty if nothing is wrong.
    """

    number: int
    sent: float
    velocity: Velocity | None
    hold: str
    proof: bytes = b""


class Reply(NamedTuple):
    """Whether a request was carried out; if not, a sentence for the person who made it. `ended`: the window's session
    is over, because its account was removed or changed."""

    ok: bool
    reason: str = ""
    ended: bool = False


class Offer(NamedTuple):
    """The answer to a window that wants to join: its session, and the lease's fresh public key; both empty if
    refused."""

    session: str
    key: bytes
    reason: str = ""


def sign_join(key: bytes) -> bytes:
    """Return the proof with which a window joins."""
    return signing.sign(key, "join", 1)


def sign_joined(key: bytes) -> bytes:
    """Return the proof by which a window that has joined knows that the lease is genuine."""
    return signing.sign(key, "joined", 1)


def sign_reply(key: bytes, number: int, reply: Reply) -> bytes:
    """Return the proof that belongs in the answer to request `number`."""
    return signing.sign(key, "reply", number, bytes((reply.ok, reply.ended)), as_bytes(reply.reason))


def sign_command(key: bytes, command: SignedCommand) -> bytes:
    """Return the proof that belongs in the command."""
    return signing.sign(key, "command", command.number, *command_parts(command))


def sign_request(key: bytes, number: int, action: str, to: str = "") -> bytes:
    """Return the proof for `DriveLease.ask`."""
    return signing.sign(key, "request", number, as_bytes(action), as_bytes(to))


def command_parts(command: SignedCommand) -> tuple[bytes, bytes]:
    """Return what of a command is signed besides its number."""
    velocity = command.velocity or ZERO
    return struct.pack("<d?3d", command.sent, command.velocity is not None, *velocity), as_bytes(command.hold)


def as_bytes(text: str) -> bytes:
    """Encode any text of a stranger, one that is no UTF-8 too."""
    return text.encode("utf-8", "surrogatepass")
