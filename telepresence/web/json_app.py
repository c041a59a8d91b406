"""JSON over HTTP for simulated robots: request bodies read with care, refusals with a reason, answers for WSGI.

A robot's own module says which paths there are and what they do. A body is checked completely before anything happens,
so that a bad one has no effect; whoever sent it gets a sentence that says what is expected.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

import gevent

from telepresence.web.origin import foreign, own_names

JSON, HTML, JPEG, PNG, TEXT, BINARY = (
    "application/json",
    "text/html; charset=utf-8",
    "image/jpeg",
    "image/png",
    "text/plain; charset=utf-8",
    "application/octet-stream",
)
_STATUS_LINES = {
    200: "200 OK",
    303: "303 See Other",
    400: "400 Bad Request",
    403: "403 Forbidden",
    404: "404 Not Found",
    405: "405 Method Not Allowed",
    413: "413 Content Too Large",
    500: "500 Internal Server Error",
    503: "503 Service Unavailable",
}
_POLL = 0.01
"""Seconds between two checks for a picture that is on its way."""

Environ = dict[str, Any]
StartResponse = Callable[[str, list[tuple[str, str]]], Any]
Application = Callable[[Environ, StartResponse], Iterable[bytes]]
Headers = tuple[tuple[str, str], ...]
T = TypeVar("T")


@dataclass(frozen=True)
class Response:
    """An HTTP answer."""

    status: int = 200
    body: bytes = b""
    content_type: str = JSON
    headers: Headers = ()


class Refusal(Exception):
    """A request is not served; the text says why, as one sentence for the client.

    Args:
        status: 4xx or 5xx, one that `json_app` knows.
        headers: To be sent besides the usual ones.
    """

    def __init__(self, status: int, reason: str, headers: Headers = ()) -> None:
        super().__init__(reason)
        self.status = status
        self.headers = headers


class BadRequest(Refusal):
    """The body is not what this path takes: status 400."""

    def __init__(self, reason: str, headers: Headers = ()) -> None:
        super().__init__(400, reason, headers)


def json_app(
    answer: Callable[[str, str, Environ], Response], headers: Headers = (), *, any_page: bool = False
) -> Application:
    """Make a WSGI application, to be served by `telepresence.web.server.WebServer`.

    Args:
        answer: Takes method, path and environ; may raise `Refusal`. For HEAD its body is left out.
        headers: Sent with every response.
        any_page: Serve pages of other web servers, too. Otherwise what they send from somebody's browser is refused
            with 403 and has no effect; programs that are no browser notice nothing, whatever they call this machine
            (see `telepresence.web.origin`).
    """
    names = own_names()

    def app(environ: Environ, start_response: StartResponse) -> Iterable[bytes]:
        method = environ["REQUEST_METHOD"]
        try:
            reason = None if any_page else foreign(environ, names, programs=True)
            if reason:
                raise Refusal(403, reason, (("Connection", "close"),))  # what is left of its body is nobody's
            response = answer(method, environ.get("PATH_INFO", "/"), environ)
        except Refusal as refusal:
            response = Response(refusal.status, f"{refusal}\n".encode(), TEXT, refusal.headers)
        length = ("Content-Length", str(len(response.body)))
        sent = [("Content-Type", response.content_type), length, *response.headers, *headers]
        start_response(_STATUS_LINES[response.status], sent)
        return [] if method == "HEAD" else [response.body]

    return app


def read_json(environ: Environ, path: str, limit: int) -> Any:
    """Return the value in a request's body.

    Args:
        path: Named when the body is refused.
        limit: Largest body [bytes].
    Raises:
        Refusal: The body is too large, shorter than announced, or not JSON; see `from_json`.
    """
    length = int(environ.get("CONTENT_LENGTH") or 0)  # the server has refused anything but digits
    body = environ["wsgi.input"].read(limit + 1) if length <= limit else None
    # What is left of such a body would be taken for the next request.
    close = (("Connection", "close"),)
    if body is None or len(body) > limit:
        raise Refusal(413, f"{path} takes at most {limit} bytes", close)
    if len(body) < length:
        raise BadRequest(f"{length} bytes were announced, {len(body)} arrived", close)
    return from_json(body)


def from_json(body: bytes) -> Any:
    """Return the value that a JSON text describes.

    Raises:
        BadRequest: It is empty, not JSON, or holds NaN or an infinity.
    """
    if not body.strip():
        raise BadRequest("the body is empty, not JSON")
    try:
        return json.loads(body.decode("utf-8"), parse_constant=_refuse_constant)
    except UnicodeDecodeError as error:
        raise BadRequest(f"the body is not JSON: it is not UTF-8, {error.reason} at byte {error.start}") from None
    except RecursionError:
        raise BadRequest("the body is not JSON: it is nested too deeply") from None
    except ValueError as error:
        raise BadRequest(f"the body is not JSON: {error}") from None


def wait_for_picture(read: Callable[[], T | None], timeout: float) -> T | None:
    """Return the first picture that `read` finds within `timeout` seconds; other requests are served meanwhile."""
    deadline = time.monotonic() + timeout
    picture = read()
    while picture is None and time.monotonic() < deadline:
        gevent.sleep(_POLL)
        picture = read()
    return picture


# --- values of a body: each returns the value or raises BadRequest; `meaning` says what belongs there -----------------


def numbers(value: Any, count: int, meaning: str) -> tuple[float, ...]:
    """Return `count` finite numbers."""
    if not isinstance(value, list) or len(value) != count:
        raise BadRequest(f"expected {meaning}: an array of {count} numbers, got {shown(value)}")
    return tuple(number(item, meaning) for item in value)


def number(value: Any, meaning: str) -> float:
    """Return a finite number."""
    try:
        found = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    except OverflowError:  # a whole number too large for a float
        found = math.inf
    if not math.isfinite(found):
        raise BadRequest(f"expected {meaning}: {shown(value)} is not a finite number")
    return found


def index(value: Any, count: int, meaning: str) -> int:
    """Return a whole number from 0 to `count` - 1."""
    found = number(value, meaning)
    if found != int(found) or not 0 <= found < count:
        raise BadRequest(f"expected {meaning}: a whole number from 0 to {count - 1}, got {shown(value)}")
    return int(found)


def boolean(value: Any, meaning: str) -> bool:
    """Return true or false, for which 1 and 0 may stand."""
    if not isinstance(value, int | float) or value not in (0, 1):
        raise BadRequest(f"expected {meaning}: true or false, got {shown(value)}")
    return bool(value)


def booleans(value: Any, count: int, meaning: str) -> list[bool]:
    """Return `count` times true or false, for which 1 and 0 may stand."""
    if not isinstance(value, list) or len(value) != count:
        raise BadRequest(f"expected {meaning}: an array of {count} booleans, got {shown(value)}")
    return [boolean(item, meaning) for item in value]


def member(value: Any, name: str, meaning: str) -> Any:
    """Return the member `name` of an object."""
    if not isinstance(value, dict):
        raise BadRequest(f"expected {meaning}: an object, got {shown(value)}")
    if name not in value:
        raise BadRequest(f"expected {meaning}: the object has no {name!r}")
    return value[name]


def text(value: Any, meaning: str) -> str:
    """Return a string that is not blank, without blanks around it."""
    if not isinstance(value, str) or not value.strip():
        raise BadRequest(f"expected {meaning}: a text, got {shown(value)}")
    return value.strip()


def shown(value: Any) -> str:
    """Return a value as it appears in a refusal, cut to 60 characters."""
    printed = repr(value)
    return printed if len(printed) <= 60 else printed[:57] + "..."


def _refuse_constant(name: str) -> None:
    raise BadRequest(f"{name} is not a finite number")
