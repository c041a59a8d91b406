"""Which requests a page of somebody else's made in the pilot's browser: they are refused.

Any page that is open in a browser can send requests to programs of the same machine. It reads no answer, but what it
sends has its effect, and a body of type text/plain needs nobody's consent (Fetch standard, "simple" requests). Browsers
say where a request comes from, in headers that no script can set:

    Host              the name in the address. A page of evil.example whose name suddenly leads to 127.0.0.1 (DNS
                      rebinding) counts as ours but for this name, and cannot be called localhost or 127.0.0.1
    Origin            with every request that may change something, and with every WebSocket
    Sec-Fetch-Site    with every request to this machine, pictures and frames included (Fetch Metadata; not from
                      browsers before 2020, nor over plain HTTP to other machines)

Programs that are no browser send neither of the last two. They do send the first: by what name they know this machine
is up to those who run them, a container's name or an alias of their network, and does no harm, because nobody can lead
them here by DNS rebinding. Where programs are served, `foreign` looks at the name only if the request may be a
browser's (`may_be_a_browsers`).
"""

from __future__ import annotations

import functools
import ipaddress
import socket
from collections.abc import Mapping
from typing import Any

_OWN_SITE = (None, "same-origin", "none")
"""None: no browser, or an old one; "none": somebody typed the address."""
_BROWSERS_HEADERS = ("HTTP_ACCEPT_LANGUAGE", "HTTP_ORIGIN", "HTTP_REFERER", "HTTP_COOKIE")


@functools.lru_cache(maxsize=256)
def is_own_name(host: str, names: frozenset[str]) -> bool:
    """Return whether a Host header names this machine: an IP address, localhost, or one of `names` (lower case).

    Args:
        host: With or without a port; "" counts: browsers always send one.
    """
    name = host.rsplit(":", 1)[0] if host.count(":") == 1 or "]" in host else host
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return not host or name.lower() in names
    return True


@functools.cache
def own_names() -> frozenset[str]:
    """Return the names of this machine that need no name server."""
    return frozenset({"localhost", socket.gethostname().lower()})


def may_be_a_browsers(environ: Mapping[str, Any]) -> bool:
    """Return whether a request has anything by which browsers are known; in doubt it has.

    A page under a rebound name reads without Origin, and over plain HTTP without Sec-Fetch-Site, which browsers send to
    trustworthy addresses only. It may leave out Referer and cookies, and Firefox lets it choose User-Agent.
    Accept-Language it may change, but not remove: Chromium and Firefox add it to every request, whatever makes it. curl
    and the HTTP clients of Python send none of these; those of Node and Qt send some, and need a name that is known.

    Args:
        environ: WSGI environment.
    """
    return (
        any(name in environ for name in _BROWSERS_HEADERS)
        or any(name.startswith("HTTP_SEC_") for name in environ)
        or "mozilla" in environ.get("HTTP_USER_AGENT", "").lower()
    )


def foreign(
    environ: Mapping[str, Any], names: frozenset[str], scheme: str = "http", *, programs: bool = False
) -> str | None:
    """Return why a request counts as another page's, as a sentence for its sender; None when it does not.

    Args:
        environ: WSGI environment.
        names: See `is_own_name`.
        scheme: Of our own pages' addresses.
        programs: Programs that are no browser may use any name for this machine.
    """
    host = environ.get("HTTP_HOST", "")
    if not is_own_name(host, names) and not (programs and not may_be_a_browsers(environ)):
        return f"This machine is not called {host[:80]!r}: use its IP address."
    origin = environ.get("HTTP_ORIGIN")
    if origin is not None and origin != f"{scheme}://{host}":
        return f"This request comes from a page of {origin[:80]!r}, which may not send any."
    if environ.get("HTTP_SEC_FETCH_SITE") not in _OWN_SITE:
        return "This request comes from a page of another server, which may not send any."
    return None
