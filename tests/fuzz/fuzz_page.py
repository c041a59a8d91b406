"""Targets: what browsers send on the channels of the pilot's page."""

from __future__ import annotations

import json
import math
from collections.abc import Callable

from fuzz_harness import Target


def page_drive() -> Target:
    """Velocities and signs of life."""
    from telepresence.page.commands import FASTEST, FASTEST_TURN, BadMessage, parse_drive

    def feed(data: bytes) -> None:
        message = parse_drive(_text(data))
        assert message.number > 0 and math.isfinite(message.sent)
        if message.velocity is not None:
            vx, vy, wz = message.velocity
            assert math.hypot(vx, vy) <= FASTEST and abs(wz) <= FASTEST_TURN, message

    return _target(
        feed,
        BadMessage,
        {"n": 17, "t": 12.35, "v": [0.2, 0.0, -0.1], "hold": ""},
        {"n": 18, "t": 12.4, "v": None, "hold": "Another tab is in front."},
    )


def page_floor() -> Target:
    """Places on the floor, as shares of the picture."""
    from telepresence.page.commands import FASTEST, BadMessage, parse_floor

    def feed(data: bytes) -> None:
        message = parse_floor(_text(data))
        assert message.number > 0 and message.press > 0 and math.isfinite(message.sent)
        assert all(0.0 <= share <= 1.0 for share in message.at) and 0.0 <= message.speed <= FASTEST, message
        assert message.stamp is None or math.isfinite(message.stamp)

    held = {"n": 18, "t": 12.4, "at": [0.4, 0.8], "press": 2, "stamp": 1.7e9, "speed": 0.2, "hold": ""}
    return _target(feed, BadMessage, held, held | {"at": [0, 1], "stamp": None})


def page_look() -> Target:
    """Where somebody wants to look."""
    from telepresence.page.commands import FARTHEST, BadMessage, parse_look

    def feed(data: bytes) -> None:
        message = parse_look(_text(data))
        assert message.number > 0 and math.isfinite(message.sent)
        assert abs(message.look.yaw) <= FARTHEST and abs(message.look.pitch) <= FARTHEST, message

    return _target(
        feed,
        BadMessage,
        {"n": 4, "t": 12.35, "do": "goal", "at": [0.5, -0.1]},
        {"n": 5, "t": 12.4, "do": "rate", "at": [0, 1]},
        {"n": 6, "t": 12.45, "do": "ahead", "at": None},
    )


def page_ask() -> Target:
    """Requests."""
    from telepresence.page.commands import REQUESTS, BadMessage, parse_ask

    def feed(data: bytes) -> None:
        message = parse_ask(_text(data))
        assert message.number > 0 and message.action in REQUESTS
        assert message.value is None or isinstance(message.value, str | bool), message

    return _target(
        feed,
        BadMessage,
        {"id": 3, "do": "give", "with": "ben"},
        {"id": 4, "do": "stop", "with": None},
        {"id": 5, "do": "listen", "with": True},
    )


def page_forwarded() -> Target:
    """Whose request it is, as a browser writes it, and as the site's proxy passes it on."""
    from telepresence.page.attempts import network
    from telepresence.page.proxy import UNKNOWN, forwarded_for

    def feed(data: bytes) -> None:
        client = forwarded_for(data.decode("latin-1").split("\n"))
        assert client == UNKNOWN or (network(client) and "," not in client), client

    valid = (b"10.0.0.7", b"1.2.3.4, fd00::7", b"1.2.3.4\nfe80::1%eth0", b"")
    return Target(feed, valid, (), 500)


def _text(data: bytes) -> str | bytes:
    """Return text as browsers send it, or bytes that are none, which they can send as well."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data


def _target(feed: Callable[[bytes], None], refusal: type[Exception], *valid: dict) -> Target:
    return Target(feed, tuple(json.dumps(fields).encode() for fields in valid), (refusal,), 1500)
