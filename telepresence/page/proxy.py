"""The page behind a proxy: a site of many robots has one address, https://HOST/ROBOT/, and this page is one robot's.

The proxy takes /ROBOT away and leaves `Host` as the browser has sent it. X-Forwarded-For says whose request it is, and
anybody can write: it counts only if the proxy itself has sent the request. That is certain on a unix socket in a folder
of our own, which no other user can enter, and with TCP if the proxy's address cannot be taken by others (a VPN).

Robots of a site share a host, and so their pages would share a cookie with the prefix __Host-. Each page has a cookie
for its own path instead: browsers show it to no other robot.
"""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from urllib.parse import urlsplit

from aiohttp import web

from telepresence.page.sign_ins import COOKIE, COOKIE_OF_PATH

SOCKET = "unix:"
"""How the place of a proxy begins that comes by a unix socket."""
UNKNOWN = "unknown"
"""The address of a client whom the proxy does not name: never this very machine."""
_PATH = re.compile(r"/(?:[A-Za-z0-9_-]{1,40}/){1,4}|/")


@dataclass(frozen=True)
class Way:
    """How one request came.

    Attributes:
        client: Address of the browser.
        cookie, path: Name of the sign-in's cookie there, and what it is for.
    """

    client: str
    cookie: str = COOKIE
    path: str = "/"


@dataclass(frozen=True)
class Proxy:
    """What stands between browsers and the page.

    Args:
        url: How browsers reach the page through it, https://HOST[:PORT]/ROBOT/.
        place: From where it speaks to the page: unix:FILE, or an IP address.
    Raises:
        ValueError: One of them is invalid.
    """

    url: str
    place: str

    def __post_init__(self) -> None:
        parts = urlsplit(self.url)
        if parts.scheme != "https" or not parts.hostname or not _PATH.fullmatch(parts.path) or parts.query:
            raise ValueError(f"{self.url!r} is not of the form https://HOST[:PORT]/ROBOT/")
        if not self.socket:
            ipaddress.ip_address(self.place)

    @property
    def socket(self) -> str:
        """The file of the unix socket where the page listens for it; empty for none."""
        return self.place.removeprefix(SOCKET) if self.place.startswith(SOCKET) else ""

    @property
    def name(self) -> str:
        """The host in its address."""
        return urlsplit(self.url).hostname or ""

    @property
    def path(self) -> str:
        return urlsplit(self.url).path

    def sent(self, peer: str) -> bool:
        """Return whether it is the proxy that speaks from this address; a unix socket has none."""
        if self.socket:
            return not peer
        try:
            return ipaddress.ip_address(peer) == ipaddress.ip_address(self.place)
        except ValueError:
            return False


def way_of(request: web.Request, proxy: Proxy | None) -> Way:
    """Return how a request came: by the proxy, or directly."""
    peer = request.remote or ""
    if proxy is None or not proxy.sent(peer):
        return Way(peer)
    return Way(forwarded_for(request.headers.getall("X-Forwarded-For", [])), COOKIE_OF_PATH, proxy.path)


def forwarded_for(headers: list[str]) -> str:
    """Return whose request a proxy says it is: the last address, as it has written only that one itself."""
    word = headers[-1].rpartition(",")[2].strip() if headers else ""
    try:
        return str(ipaddress.ip_address(word))
    except ValueError:
        return UNKNOWN
