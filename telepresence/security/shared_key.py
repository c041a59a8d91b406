# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP031
"""The part of a robot's key (`telepresence.security.robot_key`) that robots need too. Standard library only."""

import binascii
import errno
import os
import re
import socket

from telepresence.security import signing
from telepresence.security.owned_file import NotPrivate, open_file

MYPY = False
if MYPY:
    from os import PathLike  # noqa: F401
    from typing import TypeVar, Union  # noqa: F401

    Self = TypeVar("Self", bound="SharedKey")

SIZE = 32
"""Length of a key [bytes]; twice as many digits in its file."""
MOST_TEXT = 4 * SIZE
"""Length of a key's file at most [bytes]."""


class SharedKey(object):
    """32 random bytes that a robot and its pilots share.

    Args:
        secret: The bytes.
    Raises:
        ValueError: They are not 32.
    """

    def __init__(self, secret):
        # type: (bytes) -> None
        if len(secret) != SIZE:
            raise ValueError("a robot's key has %d bytes, not %d" % (SIZE, len(secret)))
        self._secret = bytes(secret)

    def __repr__(self):
        # type: () -> str
        return "RobotKey(%s)" % self.fingerprint

    def __eq__(self, other):
        # type: (object) -> bool
        return isinstance(other, SharedKey) and signing.same(self._secret, other._secret)

    def __ne__(self, other):
        # type: (object) -> bool
        return not self == other

    def __hash__(self):
        # type: () -> int
        return hash(self.fingerprint)

    @classmethod
    def parse(cls, text):
        # type: (type[Self], str) -> Self
        """Return the key that stands in a file, or that somebody typed: 64 hexadecimal digits, blanks between allowed.

        Raises:
            ValueError: It is none.
        """
        digits = "".join(text.split())
        if len(digits) != 2 * SIZE or not re.match(r"[0-9A-Fa-f]+\Z", digits):
            raise ValueError("this is no robot's key: expected %d hexadecimal digits" % (2 * SIZE))
        return cls(binascii.unhexlify(digits.encode("ascii")))

    @classmethod
    def read(cls, path):
        # type: (type[Self], Union[str, PathLike[str]]) -> Self
        """Return the key in a file that nobody but its owner can read.

        Raises:
            ValueError: It is malformed, a symbolic link, or others may read it; the text has the remedy.
            OSError: It cannot be read.
        """
        try:
            descriptor = open_file(path, tighten=False)
        except NotPrivate as refused:
            problem = ValueError("the key at %s" % refused)  # type: Exception
        except OSError as error:
            missing = error.errno == errno.ENOENT
            remedy = "make_bundle.py makes one (docs/robotino.md; for Pepper: docs/pepper.md)"
            reason = "there is no key at %s: %s" % (path, remedy)
            failed = "the key at %s cannot be read: %s" % (path, error.strerror)
            problem = type(error)(reason) if missing else OSError(error.errno, failed)
        else:
            try:
                text = os.read(descriptor, MOST_TEXT + 1)
            finally:
                os.close(descriptor)
            try:
                return cls.parse(text.decode("ascii"))
            except ValueError:  # UnicodeDecodeError too
                wanted = "expected %d hexadecimal digits" % (2 * SIZE)
                problem = ValueError("%s holds no robot's key: %s" % (path, wanted))
        raise problem

    @property
    def fingerprint(self):
        # type: () -> str
        """Eight digits by which people compare keys; says nothing about the key."""
        return hexadecimal(self.mac("fingerprint"))[:8]

    @property
    def text(self):
        # type: () -> str
        """The key itself, as 64 digits: to be shown once, to be written into its file."""
        return hexadecimal(self._secret)

    def mac(self, purpose, *parts):
        # type: (str, *bytes) -> bytes
        """Return the HMAC-SHA256 of the parts with this key, 32 bytes; see `telepresence.security.signing.mac`."""
        return signing.mac(self._secret, purpose, *parts)

    def matches(self, mac, purpose, *parts):
        # type: (bytes, str, *bytes) -> bool
        """Return whether `mac` is that of the parts, in a time that says nothing about the difference."""
        return signing.same(mac, self.mac(purpose, *parts))


def hexadecimal(octets):
    # type: (bytes) -> str
    """Return the digits of these bytes, two for each."""
    return str(binascii.hexlify(octets).decode("ascii"))


def is_loopback(host):
    # type: (str) -> bool
    """Return whether nobody but this machine reaches a host: an address, or a name all of whose addresses are such.

    Raises:
        OSError: The name has no address.
    """
    addresses = [str(entry[4][0]).partition("%")[0] for entry in socket.getaddrinfo(host, None)]
    return all(address == "::1" or address.startswith("127.") for address in addresses)
