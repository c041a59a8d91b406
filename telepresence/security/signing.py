"""Signed, numbered messages between two who share a key: what the drive lease and the drive wire have in common.

Both sides draw a random number (a nonce) for each session, and sign with a key that follows from the shared one and
both nonces. So nothing that was recorded in one session counts in another one; within a session every message has a
higher number than the one before. HMAC-SHA256 (RFC 2104) over parts with their lengths, so that no two lists of parts
sign alike.
"""

from __future__ import annotations

import enum
import hmac
import secrets
import struct

NONCE = 16
"""Length of a random number [bytes]."""
PROOF = 16
"""Length of the proof in a message [bytes]: half of the HMAC, as RFC 2104 allows."""
LARGEST_NUMBER = (1 << 63) - 1

_SEAL = struct.Struct(f">Q{PROOF}s")
SEAL = _SEAL.size
"""Bytes that `seal` adds."""


def nonce() -> bytes:
    """Return a new random number of `NONCE` bytes."""
    return secrets.token_bytes(NONCE)


def mac(key: bytes, purpose: str, *parts: bytes) -> bytes:
    """Return the HMAC-SHA256 of the parts, 32 bytes.

    Args:
        purpose: What it is for; an HMAC for one purpose is none for another.
    """
    text = purpose.encode() + b"\0"
    for part in parts:
        text += len(part).to_bytes(4, "big") + part
    return hmac.digest(key, text, "sha256")


def session_key(key: bytes, purpose: str, *nonces: bytes) -> bytes:
    """Return the key of one session, from the shared key and the nonces of both sides."""
    return mac(key, purpose, *nonces)


def sign(key: bytes, purpose: str, number: int, *parts: bytes) -> bytes:
    """Return the proof for message `number` with these parts."""
    return mac(key, purpose, number.to_bytes(8, "big"), *parts)[:PROOF]


class Check(enum.Enum):
    """What was found about a message."""

    GOOD = "good"
    FORGED = "forged"
    """Signed with another key, for another purpose, or changed on its way."""
    REPEATED = "repeated"
    """Genuine, but not newer than one that was received before."""


class Received:
    """Checks the messages of one sender in one session. Those of each purpose are counted on their own.

    Args:
        key: Of the session.
    """

    def __init__(self, key: bytes) -> None:
        self._key = key
        self._newest: dict[str, int] = {}

    def check(self, proof: bytes, purpose: str, number: int, *parts: bytes) -> Check:
        """Return whether a message counts; one that does makes all with lower numbers count no more."""
        if not 0 <= number <= LARGEST_NUMBER:
            return Check.FORGED
        if not hmac.compare_digest(proof, sign(self._key, purpose, number, *parts)):
            return Check.FORGED
        if number <= self._newest.get(purpose, 0):
            return Check.REPEATED
        self._newest[purpose] = number
        return Check.GOOD

    def unseal(self, purpose: str, sealed: bytes) -> bytes | None:
        """Return the body of a message that `seal` made; None if it is not genuine or not newer."""
        if len(sealed) < SEAL:
            return None
        number, proof = _SEAL.unpack_from(sealed)
        body = sealed[SEAL:]
        return body if self.check(proof, purpose, number, body) is Check.GOOD else None


def seal(key: bytes, purpose: str, number: int, body: bytes) -> bytes:
    """Return message `number`, from 1 up, as bytes: number, proof, body."""
    return _SEAL.pack(number, sign(key, purpose, number, body)) + body
