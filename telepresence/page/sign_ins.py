"""Who is in: the cookies of people who have signed in, and how long they last. No clock: the time is an argument.

Sign-ins survive a restart of the page's program. With the cookie a browser holds the key to its own: the file keeps a
hash of the cookie, and, encrypted under the cookie (HKDF-SHA256, ChaCha20-Poly1305), what drive_lease needs of the
person. Who reads the file can neither come in nor drive.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import logging
import secrets
from dataclasses import dataclass
from pathlib import Path

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from telepresence.security import private_files
from telepresence.teleop.accounts import is_guest_name
from telepresence.teleop.key_agreement import Credential
from telepresence.teleop.lease_messages import Account

log = logging.getLogger(__name__)

COOKIE = "__Host-pilot"
"""Cookies of this prefix come by HTTPS only, for this host and every path (RFC 6265bis, 4.1.3.2)."""
COOKIE_OF_PATH = "__Secure-pilot"
"""Likewise, but for one path: of a page that shares its host, see `proxy`."""
IDLE_LIFE, LIFE = 3600.0, 12 * 3600.0
"""Seconds without a request, and in all, after which a sign-in ends."""
SAVED = 60.0
"""[s] between two times when the file learns that somebody is still there."""
REMEMBERED = 60.0
"""[s] for which a sign-in that was ended can ask why."""
MOST, MOST_OF_ONE = 64, 8
"""Sign-ins in all, and of one person: the oldest one ends, a guest's first."""
_NONCE = 12


@dataclass(eq=False)
class SignIn:
    """One browser of one person.

    Attributes:
        name: Names the browser, as a node does a window: for others to see, and no secret.
        began, used: [s since 1970].
    """

    account: Account
    name: str
    began: float
    used: float


@dataclass
class _Kept:
    """A sign-in as the file holds it, until its browser comes with the key."""

    sealed: bytes
    began: float
    used: float


class SignIns:
    """The sign-ins of a page. Only a hash of each cookie is kept.

    Args:
        file: Where they survive a restart; None for nowhere.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._sign_ins: dict[bytes, SignIn] = {}
        self._kept: dict[bytes, _Kept] = _read(file)
        self._ended: dict[bytes, tuple[str, float]] = {}
        self._lapsed: list[SignIn] = []
        self._saved = 0.0

    def begin(self, account: Account, now: float) -> tuple[str, SignIn]:
        """Let somebody in; the cookie, and what it stands for."""
        self._forget_old(now)
        mine = [key for key, one in self._sign_ins.items() if one.account.name == account.name]
        for key in mine[: max(0, len(mine) - MOST_OF_ONE + 1)]:
            self._drop(key)
        while len(self._kept) >= MOST:
            guests = (key for key, one in self._sign_ins.items() if is_guest_name(one.account.name))
            self._drop(next(guests, next(iter(self._kept))))  # guests keep nobody out who has an account
        cookie = secrets.token_urlsafe(32)
        sign_in = SignIn(account, f"browser_{secrets.token_hex(4)}", now, now)
        self._sign_ins[_hash(cookie)] = sign_in
        self._kept[_hash(cookie)] = _Kept(_seal(cookie, sign_in), now, now)
        self.save(now)
        return cookie, sign_in

    def find(self, cookie: str, now: float) -> SignIn | None:
        """Return whose cookie this is; None for nobody's."""
        self._forget_old(now)
        key = _hash(cookie)
        if key not in self._sign_ins and key in self._kept:
            revived = _unseal(cookie, self._kept[key])
            if revived is None:
                self._drop(key)
            else:
                self._sign_ins[key] = revived
        sign_in = self._sign_ins.get(key)
        if sign_in is not None:
            sign_in.used = now
        return sign_in

    def returns(self, cookie: str) -> bool:
        """Return whether this cookie is of before the program's restart, and was not seen since."""
        key = _hash(cookie)
        return key in self._kept and key not in self._sign_ins

    def all(self) -> list[SignIn]:
        """Return everybody who is in, and has been seen since the program started."""
        return list(self._sign_ins.values())

    def holds(self, sign_in: SignIn) -> bool:
        """Return whether this sign-in has not ended."""
        return any(one is sign_in for one in self._sign_ins.values())

    def take_lapsed(self, now: float) -> list[SignIn]:
        """Return those that have ended by themselves since this was called last: too old, or one of too many."""
        self._forget_old(now)
        lapsed, self._lapsed = self._lapsed, []
        return lapsed

    def end(self, sign_in: SignIn, now: float, reason: str = "") -> bool:
        """Let somebody out, who may ask why; return whether they were in."""
        keys = [key for key, one in self._sign_ins.items() if one is sign_in]
        for key in keys:
            del self._sign_ins[key]
            self._kept.pop(key, None)
            if reason:
                self._ended[key] = reason, now
        self.save(now)
        return bool(keys)

    def why_ended(self, cookie: str) -> str:
        """Return why this sign-in was ended; empty if it was not, or too long ago."""
        return self._ended.get(_hash(cookie), ("", 0.0))[0]

    def save(self, now: float) -> None:
        """Write the file; where that fails, people sign in again after a restart."""
        self._saved = now
        if self._file is None:
            return
        for key, one in self._sign_ins.items():
            self._kept[key].used = one.used
        rows = [[_text(key), _text(one.sealed), one.began, one.used] for key, one in self._kept.items()]
        try:
            private_files.make_folder(self._file.parent, close=False)
            private_files.write(self._file, json.dumps(rows).encode())
        except OSError as error:
            log.error("sign-ins will not survive a restart of the page: %s", error)

    def save_now_and_then(self, now: float) -> None:
        """Write the file if it was not written lately."""
        if now - self._saved >= SAVED and self._sign_ins:
            self.save(now)

    def _drop(self, key: bytes) -> None:
        lapsed = self._sign_ins.pop(key, None)
        if lapsed is not None:
            self._lapsed.append(lapsed)
        self._kept.pop(key, None)

    def _forget_old(self, now: float) -> None:
        for key, kept in list(self._kept.items()):
            one = self._sign_ins.get(key, kept)
            # The clock may have been set back; then nobody knows how long ago it was.
            if not (now - one.used <= IDLE_LIFE and -IDLE_LIFE <= now - one.began <= LIFE):
                self._drop(key)
        self._ended = {key: ended for key, ended in self._ended.items() if now - ended[1] <= REMEMBERED}


def _hash(cookie: str) -> bytes:
    return hashlib.sha256(cookie.encode("utf-8", "surrogatepass")).digest()


def _cipher(cookie: str) -> ChaCha20Poly1305:
    secret = cookie.encode("utf-8", "surrogatepass")
    return ChaCha20Poly1305(HKDF(SHA256(), 32, salt=None, info=b"telepresence: sign-in").derive(secret))


def _seal(cookie: str, sign_in: SignIn) -> bytes:
    account = sign_in.account
    fields = {
        "name": account.name,
        "role": account.role,
        "rank": account.rank,
        "public": _text(account.public),
        "private": _text(account.credential.private),
        "lease": _text(account.credential.lease),
        "browser": sign_in.name,
    }
    nonce = secrets.token_bytes(_NONCE)
    return nonce + _cipher(cookie).encrypt(nonce, json.dumps(fields).encode(), None)


def _unseal(cookie: str, kept: _Kept) -> SignIn | None:
    try:
        fields = json.loads(_cipher(cookie).decrypt(kept.sealed[:_NONCE], kept.sealed[_NONCE:], None))
    except (InvalidTag, ValueError):
        return None
    credential = Credential(_bytes(fields["private"]), _bytes(fields["lease"]))
    account = Account(fields["name"], fields["role"], fields["rank"], _bytes(fields["public"]), credential)
    return SignIn(account, fields["browser"], kept.began, kept.used)


def _read(file: Path | None) -> dict[bytes, _Kept]:
    """Return what a file holds; nothing if it holds anything else: then people sign in again."""
    if file is None or not file.exists():
        return {}
    try:
        rows = json.loads(private_files.read(file))
        return {_bytes(key): _Kept(_bytes(sealed), float(began), float(used)) for key, sealed, began, used in rows}
    except (OSError, ValueError, TypeError, RecursionError, binascii.Error) as error:
        log.warning("%s cannot be read (%s): people sign in again", file, str(error)[:200])
        return {}


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _bytes(text: str) -> bytes:
    return base64.b64decode(text, validate=True)
