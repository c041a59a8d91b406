"""How a window and drive_lease agree on the key of a session: three Diffie-Hellman exchanges with X25519, as in X3DH.

    window: fresh key, and the one that follows from the password        lease: fresh key, and its own
    fresh with fresh             nobody who recorded the session reads its key later
    password's with fresh        only who knows the password has the key: the stored public key is not enough
    fresh with the lease's own   only the lease that has these accounts has it, or who reads its file

The session's key is HKDF-SHA256 of the three, bound to names and public keys; both sides prove that they have it. The
lease keeps nothing between its offer and the window's proof: its fresh key follows from a secret and the offer itself.
"""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass, field

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey, X25519PublicKey
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from telepresence.security import signing

KEY = 32
"""Length of a key [bytes]."""


@dataclass(frozen=True)
class Credential:
    """What a window needs to join as somebody.

    Args:
        private: The key that follows from the password [32 bytes].
        lease: The public key of drive_lease [32 bytes].
    """

    private: bytes = field(repr=False)
    lease: bytes


EVERYBODY = hashlib.sha256(b"telepresence: names are not checked").digest()
"""Private key of everybody, and of the lease, where nobody signs in: a simulated robot."""


def public_key(private: bytes) -> bytes:
    """Return the public key that belongs to a private one [32 bytes]."""
    return X25519PrivateKey.from_private_bytes(private).public_key().public_bytes_raw()


OPEN = Credential(EVERYBODY, public_key(EVERYBODY))
"""The credential where nobody signs in."""


@dataclass(frozen=True)
class Claim:
    """Who joins: a name, the node of the window, and the window's fresh public key [32 bytes]."""

    name: str
    node: str
    key: bytes

    def parts(self) -> tuple[bytes, ...]:
        return self.name.encode("utf-8", "surrogatepass"), self.node.encode("utf-8", "surrogatepass"), self.key


class WindowSide:
    """One attempt of a window to join.

    Args:
        name, node: Of the person, and of the window.
    """

    def __init__(self, name: str, node: str, credential: Credential) -> None:
        self._fresh = X25519PrivateKey.generate()
        self._credential = credential
        self.claim = Claim(name, node, self._fresh.public_key().public_bytes_raw())

    def session_key(self, session: str, offered: bytes) -> bytes:
        """Return the session's key after the lease's offer.

        Args:
            offered: The lease's fresh public key.
        Raises:
            ValueError: It is no usable key.
        """
        own = X25519PrivateKey.from_private_bytes(self._credential.private)
        theirs, lease = _public(offered), _public(self._credential.lease)
        shared = self._fresh.exchange(theirs), own.exchange(theirs), self._fresh.exchange(lease)
        return _derive(shared, self.claim, session, offered, public_key(self._credential.private), lease)


class LeaseSide:
    """The side of drive_lease.

    Args:
        private: Its own private key, which windows recognize it by.
    """

    def __init__(self, private: bytes) -> None:
        self.set_private(private)
        self._secret = secrets.token_bytes(KEY)

    def set_private(self, private: bytes) -> None:
        """Use another private key from now on: the accounts are other ones."""
        self._own = X25519PrivateKey.from_private_bytes(private)

    def offer(self, claim: Claim, session: str) -> bytes:
        """Return the fresh public key for this window and session; it says nothing about whether the name is known."""
        return self._fresh(claim, session).public_key().public_bytes_raw()

    def session_key(self, claim: Claim, session: str, account: bytes) -> bytes:
        """Return the session's key, for a session that `offer` was asked for.

        Args:
            account: The account's public key; empty for a name that is not known, which takes as long.
        Raises:
            ValueError: The window's key is not usable.
        """
        fresh, theirs = self._fresh(claim, session), _public(claim.key)
        account = account or public_key(signing.mac(self._secret, "nobody", claim.parts()[0]))
        shared = fresh.exchange(theirs), fresh.exchange(_public(account)), self._own.exchange(theirs)
        return _derive(shared, claim, session, fresh.public_key().public_bytes_raw(), account, self._own.public_key())

    def _fresh(self, claim: Claim, session: str) -> X25519PrivateKey:
        secret = signing.mac(self._secret, "fresh key", session.encode("ascii"), *claim.parts())
        return X25519PrivateKey.from_private_bytes(secret)


def _public(key: bytes) -> X25519PublicKey:
    return X25519PublicKey.from_public_bytes(bytes(key))


def _derive(
    shared: tuple[bytes, bytes, bytes],
    claim: Claim,
    session: str,
    offered: bytes,
    account: bytes,
    lease: X25519PublicKey,
) -> bytes:
    parts = (*claim.parts(), session.encode("ascii"), offered, account, lease.public_bytes_raw())
    context = signing.mac(b"", "drive lease", *parts)
    return HKDF(SHA256(), KEY, salt=None, info=context).derive(b"".join(shared))
