# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP031
"""Signed, numbered messages between two who share a key: what the drive lease and the drive wire have in common.

Both sides draw a random number (a nonce) for each session, and sign with a key that follows from the shared one and
both nonces. So nothing that was recorded in one session counts in another one; within a session every message has a
higher number than the one before. HMAC-SHA256 (RFC 2104) over parts with their lengths, so that no two lists of parts
sign alike.
"""

import hashlib
import hmac
import os
import struct

MYPY = False
if MYPY:
    from typing import Callable, Dict, Optional, Union  # noqa: F401, UP035

NONCE = 16
"""Length of a random number [bytes]."""
PROOF = 16
"""Length of the proof in a message [bytes]: half of the HMAC, as RFC 2104 allows."""
LARGEST_NUMBER = (1 << 63) - 1

_SEAL = struct.Struct(">Q%ds" % PROOF)
SEAL = _SEAL.size
"""Bytes that `seal` adds."""
_LENGTH = struct.Struct(">I")
_NUMBER = struct.Struct(">Q")


class PreparedKey(object):
    """A key for many messages. What does not depend on the message is done once: whoever signs only now and then, and
    finds nothing of OpenSSL in the processor's caches, has a proof in half the time."""

    def __init__(self, key):
        # type: (bytes) -> None
        self._begun = hmac.new(key, digestmod=hashlib.sha256)

    def digest(self, text):
        # type: (bytes) -> bytes
        """Return the HMAC of a text."""
        whole = self._begun.copy()
        whole.update(text)
        return whole.digest()


def _digest(key, text):
    # type: (bytes, bytes) -> bytes
    return hmac.new(key, text, hashlib.sha256).digest()


def _same(one, other):
    # type: (bytes, bytes) -> bool
    """Compare in a time that depends on the lengths only, as Python 2.7.7 does it."""
    if len(one) != len(other):
        return False
    difference = 0
    for mine, yours in zip(bytearray(one), bytearray(other)):  # noqa: B905
        difference |= mine ^ yours
    return difference == 0


same = getattr(hmac, "compare_digest", _same)  # type: Callable[[bytes, bytes], bool]
"""Return whether two proofs are the same, in a time that says nothing about where they differ."""
if hasattr(hmac, "digest"):  # Python 3: in one call, several times as fast

    def _digest(key, text):
        # type: (bytes, bytes) -> bytes
        return hmac.digest(key, text, "sha256")


def nonce():
    # type: () -> bytes
    """Return a new random number of `NONCE` bytes."""
    return os.urandom(NONCE)


def mac(key, purpose, *parts):
    # type: (Union[bytes, PreparedKey], str, *bytes) -> bytes
    """Return the HMAC-SHA256 of the parts, 32 bytes.

    Args:
        key: The key itself, or prepared for many messages.
        purpose: What it is for; an HMAC for one purpose is none for another.
    """
    text = purpose.encode("ascii") + b"\0"
    for part in parts:
        text += _LENGTH.pack(len(part)) + part
    return key.digest(text) if isinstance(key, PreparedKey) else _digest(key, text)


def session_key(key, purpose, *nonces):
    # type: (bytes, str, *bytes) -> bytes
    """Return the key of one session, from the shared key and the nonces of both sides."""
    return mac(key, purpose, *nonces)


def sign(key, purpose, number, *parts):
    # type: (Union[bytes, PreparedKey], str, int, *bytes) -> bytes
    """Return the proof for message `number` with these parts."""
    return mac(key, purpose, _NUMBER.pack(number), *parts)[:PROOF]


class Check(object):
    """What was found about a message."""

    GOOD = "good"
    FORGED = "forged"
    """Signed with another key, for another purpose, or changed on its way."""
    REPEATED = "repeated"
    """Genuine, but not newer than one that was received before."""


class Received(object):
    """Checks the messages of one sender in one session. Those of each purpose are counted on their own.

    Args:
        key: Of the session.
    """

    def __init__(self, key):
        # type: (bytes) -> None
        self._key = PreparedKey(key)
        self._newest = {}  # type: Dict[str, int]

    def check(self, proof, purpose, number, *parts):
        # type: (bytes, str, int, *bytes) -> str
        """Return whether a message counts, see `Check`; one that does makes all with lower numbers count no more."""
        if not 0 <= number <= LARGEST_NUMBER:
            return Check.FORGED
        if not same(proof, sign(self._key, purpose, number, *parts)):
            return Check.FORGED
        if number <= self._newest.get(purpose, 0):
            return Check.REPEATED
        self._newest[purpose] = number
        return Check.GOOD

    def unseal(self, purpose, sealed):
        # type: (str, bytes) -> Optional[bytes]
        """Return the body of a message that `seal` made; None if it is not genuine or not newer."""
        if len(sealed) < SEAL:
            return None
        number, proof = _SEAL.unpack_from(sealed)
        body = sealed[SEAL:]
        return body if self.check(proof, purpose, number, body) == Check.GOOD else None


def seal(key, purpose, number, body):
    # type: (Union[bytes, PreparedKey], str, int, bytes) -> bytes
    """Return message `number`, from 1 up, as bytes: number, proof, body."""
    return _SEAL.pack(number, sign(key, purpose, number, body)) + body
