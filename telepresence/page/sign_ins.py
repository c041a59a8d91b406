"""Who is in: the cookies of people who have signed in, and how long they last. No clock: the time is an argument."""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass

from telepresence.teleop.lease_messages import Account

COOKIE = "__Host-pilot"
"""Cookies of this prefix come by HTTPS only, for this host and every path (RFC 6265bis, 4.1.3.2)."""
IDLE_LIFE, LIFE = 3600.0, 12 * 3600.0
"""Seconds without a request, and in all, after which a sign-in ends."""
MOST, MOST_OF_ONE = 64, 8
"""Sign-ins in all, and of one person: the oldest one ends."""


@dataclass(eq=False)
class SignIn:
    """One browser of one person.

    Attributes:
        name: Names the browser, as a node does a window: for others to see, and no secret.
        began, used: [monotonic s].
    """

    account: Account
    name: str
    began: float
    used: float


class SignIns:
    """The sign-ins of a page. Only a hash of each cookie is kept."""

    def __init__(self) -> None:
        self._sign_ins: dict[bytes, SignIn] = {}

    def begin(self, account: Account, now: float) -> tuple[str, SignIn]:
        """Let somebody in; the cookie, and what it stands for."""
        self._forget_old(now)
        mine = [key for key, one in self._sign_ins.items() if one.account.name == account.name]
        for key in mine[: max(0, len(mine) - MOST_OF_ONE + 1)]:
            del self._sign_ins[key]
        while len(self._sign_ins) >= MOST:
            del self._sign_ins[next(iter(self._sign_ins))]
        cookie = secrets.token_urlsafe(32)
        sign_in = SignIn(account, f"browser_{secrets.token_hex(4)}", now, now)
        self._sign_ins[_hash(cookie)] = sign_in
        return cookie, sign_in

    def find(self, cookie: str, now: float) -> SignIn | None:
        """Return whose cookie this is; None for nobody's."""
        self._forget_old(now)
        sign_in = self._sign_ins.get(_hash(cookie))
        if sign_in is not None:
            sign_in.used = now
        return sign_in

    def end(self, cookie: str) -> None:
        """Let somebody out."""
        self._sign_ins.pop(_hash(cookie), None)

    def _forget_old(self, now: float) -> None:
        old = [key for key, one in self._sign_ins.items() if now - one.used > IDLE_LIFE or now - one.began > LIFE]
        for key in old:
            del self._sign_ins[key]


def _hash(cookie: str) -> bytes:
    return hashlib.sha256(cookie.encode("utf-8", "surrogatepass")).digest()
