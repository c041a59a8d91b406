"""Who may open a page of ours: every request must come from our own page, or from nobody's, and carry the key.

A tablet can be given an address and nothing else, no header, and a pilot clicks on what the terminal shows. So the key
travels in the first address (`/?k=KEY`). The answer sets a cookie and leads to `/PLACE/`, where the page is from then
on: the key stands in no address bar and no history that somebody looks at. Cookies know no ports (RFC 6265, 8.5): what
keeps ours from a server of another user of the same machine is its path, which that user does not know.

Programs may send `?k=KEY` with every request instead. On plain HTTP to another machine whoever can listen can read all
of it: the key keeps out the curious of the network, not a thief of packets.
"""

from __future__ import annotations

import collections
import hashlib
import hmac
import html
import os
import secrets
import time
import urllib.parse
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from telepresence.web.origin import foreign, is_own_name, own_names

if TYPE_CHECKING:  # `./stack up` needs keys only, and no web server
    from telepresence.web.json_app import Environ, StartResponse

COOKIE = "tp"
ANNOUNCED = "TELEPRESENCE_ANNOUNCED"
"""Environment variable with the links that `./stack up` has shown, with blanks between them."""
TRIES = 10
"""Wrong keys that one address may send at once."""
SECONDS_PER_TRY = 2.0
"""Each of them is forgiven after this time."""
STRONG = 22
"""Letters of a key that nobody finds by trying: 128 random bits, see `make_token`."""
_MAX_ADDRESSES = 1000
_STATUS_LINES = {403: "403 Forbidden", 405: "405 Method Not Allowed", 429: "429 Too Many Requests"}
_HEADERS = [
    ("Cache-Control", "no-store"),
    ("X-Accel-Buffering", "no"),
    ("X-Content-Type-Options", "nosniff"),
    ("X-Frame-Options", "DENY"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
]
_REFUSAL = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=1280, user-scalable=no">
<link rel="icon" href="data:,">
<title>Not for everyone</title>
<style>
  html, body {{ height: 100%; margin: 0; background: #11161c; color: #f2f5f8; text-align: center;
                font-family: Roboto, "Segoe UI", "Helvetica Neue", "DejaVu Sans", sans-serif; }}
  h1 {{ font-weight: 300; font-size: 64px; margin: 0 0 24px; padding-top: 240px; }}
  p {{ font-size: 28px; color: #9fb0c0; margin: 0 auto; max-width: 900px; }}
</style>
</head>
<body><h1>Not for everyone</h1><p>{text}</p></body>
</html>
"""
_FORWARD = '<!DOCTYPE html><title>One moment</title><meta http-equiv="refresh" content="0; url={place}">'


def make_token() -> str:
    """A key that nobody guesses: 128 random bits, safe in an address."""
    return secrets.token_urlsafe(16)


def page_key(variable: str) -> str:
    """Return the key that the environment holds, which others cannot read as they can command lines; else a new one."""
    return os.environ.get(variable) or make_token()


def was_announced(link: str) -> bool:
    """Return whether `./stack up`, which has started this program, has shown the person at the terminal this link."""
    return link in os.environ.get(ANNOUNCED, "").split()


class Refused(Exception):
    """`status` is the HTTP status, the text is for people."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


class PageAuth:
    """Lets requests in or raises `Refused`.

    Args:
        token: The key; None lets everybody in.
        hosts: Names of this machine besides "localhost", its own and any IP address.
    """

    def __init__(self, token: str | None = None, hosts: Iterable[str] = ()) -> None:
        self._token = token.encode() if token else None
        self.names = own_names() | {host.lower() for host in hosts}
        self.session, self.place = (self._derive(purpose) for purpose in ("cookie", "place"))
        self._failures: collections.OrderedDict[str, tuple[float, float]] = collections.OrderedDict()

    def _derive(self, purpose: str) -> str:
        """Follows from the key, so that a page stays open while its program is restarted with the same key."""
        return hmac.new(self._token or b"", purpose.encode(), hashlib.sha256).hexdigest()[:32]

    @property
    def keyed(self) -> bool:
        return self._token is not None

    def check_key(self, address: str, now: float, *keys: str | None) -> None:
        """Compare what the client sent (None for nothing) with the key.

        Args:
            address: The client's; its wrong keys are counted.
            now: Monotonic time [s].
        """
        if self._token is None:
            return
        sent = [key for key in keys if key]
        if not sent:
            raise Refused(403, "Open the address with its key, as the program that serves this page printed it.")
        right = any(hmac.compare_digest(key.encode(), self._token) for key in sent)
        if right and len(self._token) >= STRONG:  # nobody can lock out who has it, from the same address
            return
        level, since = self._failures.get(address, (0.0, now))
        level = max(0.0, level - (now - since) / SECONDS_PER_TRY)
        if level > TRIES - 1:
            raise Refused(429, "Too many wrong keys. Wait a moment.")
        if right:
            return
        self._failures[address] = (level + 1.0, now)
        self._failures.move_to_end(address)
        if len(self._failures) > _MAX_ADDRESSES:
            self._failures.popitem(last=False)
        raise Refused(403, "This key is wrong, or from an earlier run of the program.")

    def has_cookie(self, header: str) -> bool:
        """Whether a Cookie header holds what `/?k=KEY` was answered with."""
        wanted = f"{COOKIE}={self.session}".encode()
        # Another server of this machine may have set one of the same name, which comes along.
        return self.keyed and any(hmac.compare_digest(part.strip().encode(), wanted) for part in header.split(";"))


class ProtectedPage:
    """A WSGI application around another one, which then need not check anything: `auth` says who gets to it.

    Args:
        app: A WSGI application that answers GET. Its pages refer to each other relatively: they are below `/PLACE/`.
        csp: Its Content-Security-Policy, without frame-ancestors and form-action.
        forms: Whether the application also answers POST, to forms of its own pages.
    """

    def __init__(self, app: Callable[..., Iterable[bytes]], auth: PageAuth, csp: str, *, forms: bool = False) -> None:
        self._app, self._auth = app, auth
        self._methods = ("GET", "HEAD", "POST") if forms else ("GET", "HEAD")
        action = "'self'" if forms else "'none'"
        policy = f"{csp}; form-action {action}; frame-ancestors 'none'"
        headers = [*_HEADERS, ("Content-Security-Policy", policy)]
        # Without any referrer the form of our own page would come from an origin called null.
        referrer = {"Referrer-Policy": "same-origin"} if forms else {}
        self._headers = [(name, referrer.get(name, value)) for name, value in headers]

    def __call__(self, environ: Environ, start_response: StartResponse) -> Iterable[bytes]:
        try:
            place = self._admit(environ)
        except Refused as refused:
            return self._say(start_response, _STATUS_LINES[refused.status], _REFUSAL, text=str(refused))
        if place is None:
            return self._app(environ, self._adding_headers(start_response))
        cookie = f"{COOKIE}={self._auth.session}; Path={place}; HttpOnly; SameSite=Strict"
        extra = [("Set-Cookie", cookie)]
        if environ.get("HTTP_SEC_FETCH_SITE") in ("cross-site", "same-site"):
            # Somebody followed a link, from a mail perhaps. A redirection would still count as that page's and take no
            # strict cookie along; our own page does.
            return self._say(start_response, "200 OK", _FORWARD, extra, place=place)
        return self._say(start_response, "302 Found", "", [("Location", place), *extra])

    def _admit(self, environ: Environ) -> str | None:
        """Return the address to go to, if this is the first request, with the key; None if it can be answered."""
        auth = self._auth
        path = environ.get("PATH_INFO", "/")
        if not (_is_followed_link(environ) and path == "/" and is_own_name(environ.get("HTTP_HOST", ""), auth.names)):
            reason = foreign(environ, auth.names)
            if reason:
                raise Refused(403, reason)
        if environ["REQUEST_METHOD"] not in self._methods:
            raise Refused(405, "This page can be read and nothing else.")
        if not auth.keyed:
            return None
        place = f"/{auth.place}/"
        if path.startswith(place):
            environ["SCRIPT_NAME"], environ["PATH_INFO"] = place.rstrip("/"), path.removeprefix(place[:-1])
            if auth.has_cookie(environ.get("HTTP_COOKIE", "")):
                return None
        auth.check_key(environ.get("REMOTE_ADDR", ""), time.monotonic(), _key(environ))
        return place if path == "/" else None

    def _adding_headers(self, start_response: StartResponse) -> StartResponse:
        def start(status: str, headers: list[tuple[str, str]], *more: object) -> object:
            ours = {name for name, _ in self._headers}
            kept = [(name, value) for name, value in headers if name not in ours]
            return start_response(status, [*kept, *self._headers], *more)

        return start

    def _say(
        self,
        start_response: StartResponse,
        status: str,
        page: str,
        extra: Iterable[tuple[str, str]] = (),
        **values: str,
    ) -> list[bytes]:
        body = page.format(**{name: html.escape(value) for name, value in values.items()}).encode()
        head = [("Content-Type", "text/html; charset=utf-8"), ("Content-Length", str(len(body))), *extra]
        start_response(status, [*head, *self._headers])
        return [body]


def _key(environ: Environ) -> str | None:
    """Return what stands for k in the address; None if nothing does."""
    try:
        return urllib.parse.parse_qs(environ.get("QUERY_STRING", ""), max_num_fields=20).get("k", [None])[0]
    except ValueError:  # an address with more parts than any of ours
        return None


def _is_followed_link(environ: Environ) -> bool:
    """Whether a person opens the page in a tab of its own, by a link on another one."""
    return (
        environ["REQUEST_METHOD"] == "GET"
        and "HTTP_ORIGIN" not in environ
        and environ.get("HTTP_SEC_FETCH_MODE") == "navigate"
        and environ.get("HTTP_SEC_FETCH_DEST") == "document"
    )
