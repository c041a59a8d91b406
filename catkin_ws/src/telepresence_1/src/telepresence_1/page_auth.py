"""Who may see the pilot: the check of every request to the page, without a web framework.

A tablet can be given an address and nothing else, no header. So the key travels in the first address (`/?k=KEY`), and a
cookie carries it from there on. On plain HTTP whoever can listen can read it: it keeps out the curious of the network,
not a thief of packets.
"""

from __future__ import annotations

import collections
import hmac
import ipaddress
import secrets
from collections.abc import Iterable

COOKIE = "tp"
TRIES = 10
"""Wrong keys that one address may send at once."""
SECONDS_PER_TRY = 2.0
"""Each of them is forgiven after this time."""
_MAX_ADDRESSES = 1000


def make_token() -> str:
    """A key that nobody guesses: 128 random bits, safe in an address."""
    return secrets.token_urlsafe(16)


class Refused(Exception):
    """`status` is the HTTP status, the text is for people."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


class PageAuth:
    """Lets requests in or raises `Refused`.

    Args:
        token: The key; None lets everybody in.
        hosts: Names of this machine besides "localhost" and any IP address.
    """

    def __init__(self, token: str | None = None, hosts: Iterable[str] = ()) -> None:
        self._token = token.encode() if token else None
        self._hosts = {"localhost", *(host.lower() for host in hosts)}
        self._failures: collections.OrderedDict[str, tuple[float, float]] = collections.OrderedDict()

    def check_host(self, header: str) -> None:
        """Compare the Host header with our names.

        A page of a stranger can let its own name point to our address and then read what we answer (DNS rebinding); it
        cannot make a browser send an IP address as host."""
        name = header.rsplit(":", 1)[0] if header.count(":") == 1 or "]" in header else header
        try:
            ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            if name.lower() not in self._hosts and header:
                raise Refused(403, f"This machine is not called {name[:80]}. Use its IP address.") from None

    def check_key(self, address: str, now: float, *keys: str | None) -> None:
        """Compare what the client sent (in its address, in its cookie; None for nothing) with the token.

        Args:
            address: The client's; its wrong keys are counted.
            now: Monotonic time [s].
        """
        if self._token is None:
            return
        sent = [key for key in keys if key]
        if not sent:
            raise Refused(403, "The pilot's picture is shown only to the robot it was opened for.")
        level, since = self._failures.get(address, (0.0, now))
        level = max(0.0, level - (now - since) / SECONDS_PER_TRY)
        if level > TRIES - 1:
            raise Refused(429, "Too many wrong keys. Wait a moment.")
        if any(hmac.compare_digest(key.encode(), self._token) for key in sent):
            return
        self._failures[address] = (level + 1.0, now)
        self._failures.move_to_end(address)
        if len(self._failures) > _MAX_ADDRESSES:
            self._failures.popitem(last=False)
        raise Refused(403, "This key is wrong, or from an earlier run of the program.")
