"""Derivation of a private key from a password: Argon2id (RFC 9106).

The key is made anew from the password whenever somebody signs in and is stored nowhere; the public key that belongs to
it is all that accounts keep of a password, and whoever reads that can neither sign in nor drive with it.
"""

from __future__ import annotations

import hashlib
import hmac
from typing import NamedTuple

from argon2.low_level import Type, hash_secret_raw

SALT = 16
"""Length of a salt [bytes]."""


class Cost(NamedTuple):
    """What one guess costs.

    Args:
        passes: Over the memory.
        memory: [KiB]
        lanes: That are computed at the same time.
    """

    passes: int
    memory: int
    lanes: int


COST = Cost(3, 1 << 16, 4)
"""RFC 9106's second recommendation: 64 MiB, and about 0.1 s."""


def private_key(password: str, salt: bytes, cost: Cost) -> bytes:
    """Return the X25519 private key that follows from a password [32 bytes]."""
    return hash_secret_raw(
        password.encode("utf-8", "surrogatepass"), salt, cost.passes, cost.memory, cost.lanes, 32, Type.ID
    )


def salt_of_nobody(name: str, secret: bytes) -> bytes:
    """Return what stands for the salt of a name that does not exist: always the same for one name."""
    return hmac.digest(secret, b"salt of nobody" + name.encode("utf-8", "surrogatepass"), hashlib.sha256)[:SALT]


def legacy_hash(password: str, salt: bytes) -> bytes:
    """Return the scrypt hash (RFC 7914) that versions before 0.4 kept of a password [32 bytes]."""
    encoded = password.encode("utf-8", "surrogatepass")
    return hashlib.scrypt(encoded, salt=salt, n=1 << 15, r=8, p=1, maxmem=1 << 26, dklen=32)
