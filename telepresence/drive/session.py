# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP031
"""Sessions on the wire to the drive server: who has the robot's key, and that each datagram is theirs, whole and new.
No ROS, no socket, no clock.

    pilot -> robot  RTD2 h  nonce[16], zeros                             longer than its answer
    robot -> pilot  RTD2 c  nonce[16] cookie[24] fingerprint[4]          of the robot's key; zeros without one
    pilot -> robot  RTD2 o  nonce[16] cookie[24] proof[16] {"type": "open", "name": ..., "rank": ...}
    both ways       RTD2 m  session[8] number[8] proof[16] body          bodies: `telepresence.drive.datagram`

The cookie is the robot's nonce. It names the moment and, by a secret of the robot, the address that asked, so the robot
remembers nothing about whoever does not prove that datagrams reach the address and that the key is there. The session's
key follows from the robot's key and both nonces; numbers rise in each direction, and each direction signs for itself.

Without a robot's key (on loopback only) everything is the same with an empty one: it proves nothing.
"""

import binascii
import os
import struct
from collections import namedtuple

from telepresence.drive.datagram import MAX_DATAGRAM, TEXT, WHOLE, BadMessage, decode, encode, is_printable
from telepresence.security import signing
from telepresence.security.shared_key import hexadecimal
from telepresence.security.signing import NONCE, PROOF, SEAL, PreparedKey, Received, same, seal

MYPY = False
if MYPY:
    from typing import Any, Dict, Optional, Tuple  # noqa: F401, UP035

    from telepresence.security.shared_key import SharedKey  # noqa: F401

    Address = tuple[Any, ...]

VERSION = b"RTD2"
HELLO, CHALLENGE, OPEN, MESSAGE = [VERSION + kind for kind in (b"h", b"c", b"o", b"m")]
COOKIE_LIFE = 2.0
"""Seconds for which a cookie opens a session: the slowest network on which a robot can be driven, twice and more."""
MOST_USED = 256
"""Sessions opened within `COOKIE_LIFE` at most."""
LONGEST_NAME = 64
HIGHEST_RANK = 1000

_KIND = len(HELLO)
_COOKIE = struct.Struct(">Q%ds" % PROOF)
_HELLO = struct.Struct("%ds%ds43x" % (_KIND, NONCE))
_CHALLENGE = struct.Struct("%ds%ds%ds4s" % (_KIND, NONCE, _COOKIE.size))
_OPEN = struct.Struct("%ds%ds%ds%ds" % (_KIND, NONCE, _COOKIE.size, PROOF))
_MESSAGE = struct.Struct("%ds8s" % _KIND)
HEADER = _MESSAGE.size + SEAL
"""Bytes of a datagram that are not its body."""
MAX_BODY = MAX_DATAGRAM - HEADER
TO_ROBOT, TO_PILOT = "drive to robot", "drive to pilot"
NO_KEY = b"\0" * 4
"""Stands for the fingerprint of a robot without a key."""


class Session(object):
    """One end of a session.

    Args:
        key: Of the session.
        sends, receives: `TO_ROBOT` and `TO_PILOT`, or the other way round.
    Attributes:
        id: Names the session in its datagrams.
    """

    def __init__(self, key, sends, receives):
        # type: (bytes, str, str) -> None
        self._key, self._sends, self._receives = PreparedKey(key), sends, receives
        self._received = Received(key)
        self._number = 0
        self.id = signing.mac(key, "drive session id")[:8]
        self._header = _MESSAGE.pack(MESSAGE, self.id)

    def seal(self, body):
        # type: (bytes) -> bytes
        """Return the next datagram.

        Raises:
            ValueError: The body is too long.
        """
        if len(body) > MAX_BODY:
            raise ValueError("a body of %d bytes fits no datagram; %d do" % (len(body), MAX_BODY))
        self._number += 1
        return self._header + seal(self._key, self._sends, self._number, body)

    def unseal(self, datagram):
        # type: (bytes) -> Optional[bytes]
        """Return the body of a datagram of this session; None if it is forged, changed, or not newer than others."""
        if not datagram.startswith(self._header):
            return None
        return self._received.unseal(self._receives, datagram[len(self._header) :])


def session_of(datagram):
    # type: (bytes) -> bytes
    """Return the id that a datagram names, which proves nothing; empty if it is none of a session."""
    return datagram[_KIND : _MESSAGE.size] if datagram.startswith(MESSAGE) and len(datagram) >= HEADER else b""


def cookie_of(datagram):
    # type: (bytes) -> bytes
    """Return the cookie that an open shows, which proves nothing; empty if it is none."""
    return _OPEN.unpack_from(datagram)[2] if datagram.startswith(OPEN) and len(datagram) >= _OPEN.size else b""


class Opened(namedtuple("Opened", "cookie session name rank")):
    """A session that a pilot has opened.

    Args:
        cookie: Another one for each session.
        name, rank: What the pilot says about itself. Whoever has the key may say anything.
    """

    __slots__ = ()


class RobotHandshake(object):
    """The robot's side of hello and open: what it knows of a pilot before the proof is in the pilot's own cookie.

    Args:
        key: The robot's; None on loopback only.
    """

    def __init__(self, key):
        # type: (Optional[SharedKey]) -> None
        self._key = key
        self._fingerprint = _fingerprint(key)
        self._secret = os.urandom(32)
        self._newest = 0
        self._used = {}  # type: Dict[int, None]

    def challenge(self, datagram, address, now):
        # type: (bytes, Address, float) -> Optional[bytes]
        """Return the answer to a hello, shorter than it; None if it is none."""
        if len(datagram) != _HELLO.size:
            return None
        kind, nonce = _HELLO.unpack(datagram)
        if kind != HELLO:
            return None
        # Every cookie is another one, however fast they are asked for.
        self._newest = max(self._newest + 1, int(now * 1e6))
        cookie = self._cookie(self._newest, nonce, address)
        return _CHALLENGE.pack(CHALLENGE, nonce, cookie, self._fingerprint)

    def accept(self, datagram, address, now):
        # type: (bytes, Address, float) -> Optional[Opened]
        """Return the session that a pilot opens; None if it has not proven the address and the key, or did so before.

        Raises:
            BadMessage: Both are proven, but name and rank cannot be used.
        """
        if not _OPEN.size <= len(datagram) <= MAX_DATAGRAM:
            return None
        kind, nonce, cookie, proof = _OPEN.unpack_from(datagram)
        stamp, _ = _COOKIE.unpack(cookie)
        if kind != OPEN or not same(cookie, self._cookie(stamp, nonce, address)):
            return None
        oldest = int((now - COOKIE_LIFE) * 1e6)
        about = datagram[_OPEN.size :]
        if stamp < oldest or not same(proof, _proof(self._key, nonce, cookie, about)):
            return None
        for each in [each for each in self._used if each < oldest]:
            del self._used[each]
        if stamp in self._used or len(self._used) >= MOST_USED:
            return None
        self._used[stamp] = None
        name, rank = _parse_about(about)
        return Opened(cookie, Session(_session_key(self._key, nonce, cookie), TO_PILOT, TO_ROBOT), name, rank)

    def _cookie(self, stamp, nonce, address):
        # type: (int, bytes, Address) -> bytes
        proof = signing.mac(self._secret, "cookie", struct.pack(">Q", stamp), nonce, repr(address).encode("ascii"))
        return _COOKIE.pack(stamp, proof[:PROOF])


class KeyMismatch(ValueError):
    """The robot and this computer do not have the same key; the text says which one has what.

    Attributes:
        robot_has_none: It says that it has no key, and this computer has one for it.
    """

    def __init__(self, fingerprint, key):
        # type: (bytes, Optional[SharedKey]) -> None
        self.robot_has_none = fingerprint == NO_KEY
        if key is None:
            text = "wants the robot's key, and this computer has none for it"
        elif self.robot_has_none:
            text = "has no key, although this computer has one for it; if it is the robot and not a stranger's program"
        else:
            text = "has another key (%s) than this computer has for it (%s)" % (
                hexadecimal(fingerprint),
                key.fingerprint,
            )
        super(KeyMismatch, self).__init__(text)  # noqa: UP008


class PilotHandshake(object):
    """The pilot's side of one hello: its nonce, and what the robot made of it.

    Args:
        key: The robot's; None on loopback only.
        name, rank: What the robot is to know about this pilot.
    Attributes:
        hello: The datagram to begin with; it may be repeated.
        open: The datagram to send after the robot's challenge, repeatedly; empty before.
        session: What `open` opens; None before.
    """

    def __init__(self, key, name, rank):
        # type: (Optional[SharedKey], str, int) -> None
        self._key = key
        self._about = encode(type="open", name=name, rank=rank)
        _parse_about(self._about)
        self._nonce = signing.nonce()
        self.hello = _HELLO.pack(HELLO, self._nonce)
        self.open = b""
        self.session = None  # type: Optional[Session]

    def take(self, datagram):
        # type: (bytes) -> bool
        """Take the robot's challenge; whether it was one, to this hello.

        Raises:
            KeyMismatch: The robot's key is another one.
        """
        if len(datagram) != _CHALLENGE.size or self.session is not None:
            return False
        kind, nonce, cookie, fingerprint = _CHALLENGE.unpack(datagram)
        if kind != CHALLENGE or nonce != self._nonce:
            return False
        if fingerprint != _fingerprint(self._key):
            raise KeyMismatch(fingerprint, self._key)
        proof = _proof(self._key, nonce, cookie, self._about)
        self.open = _OPEN.pack(OPEN, nonce, cookie, proof) + self._about
        self.session = Session(_session_key(self._key, nonce, cookie), TO_ROBOT, TO_PILOT)
        return True


def _parse_about(about):
    # type: (bytes) -> Tuple[str, int]
    fields = decode(about)
    name, rank = fields.get("name"), fields.get("rank")
    if not isinstance(name, TEXT) or not 0 < len(name) <= LONGEST_NAME or not is_printable(name):
        raise BadMessage("a pilot's name has 1 to %d printable characters" % LONGEST_NAME)
    if isinstance(rank, bool) or not isinstance(rank, WHOLE) or not 0 <= rank <= HIGHEST_RANK:
        raise BadMessage("a pilot's rank is a whole number from 0 to %d" % HIGHEST_RANK)
    return name, rank


def _fingerprint(key):
    # type: (Optional[SharedKey]) -> bytes
    return binascii.unhexlify(key.fingerprint.encode("ascii")) if key else NO_KEY


def _mac(key, purpose, *parts):
    # type: (Optional[SharedKey], str, *bytes) -> bytes
    return key.mac(purpose, *parts) if key else signing.mac(b"", purpose, *parts)


def _proof(key, nonce, cookie, about):
    # type: (Optional[SharedKey], bytes, bytes, bytes) -> bytes
    return _mac(key, "drive open", nonce, cookie, about)[:PROOF]


def _session_key(key, nonce, cookie):
    # type: (Optional[SharedKey], bytes, bytes) -> bytes
    return _mac(key, "drive session", nonce, cookie)
