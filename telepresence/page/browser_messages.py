"""What one browser says and what it gets, whatever carries it: WebRTC's channels or a websocket.

What of it counts is decided here, at each message, and never by what the page shows.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from telepresence.page.browser_window import BrowserWindow
from telepresence.page.commands import (
    REQUESTS,
    AskMessage,
    BadMessage,
    Who,
    parse_ask,
    parse_drive,
    parse_floor,
    parse_look,
)

log = logging.getLogger(__name__)

STATE_PERIOD = 0.1
"""[s] between two messages about who drives, what the gate does and how old the picture is."""
SELDOM, SELDOM_PERIOD = frozenset({"people", "ring"}), 1.0
"""Keys of the state that are long, and after how many seconds they are sent though nothing has changed."""
SILENCE = 3.0
"""[s] without a message of the page after which its connection is given up; it dials again."""
MOST_PER_SECOND = 200
"""Messages of one connection, a websocket's pings among them: several times what the page sends. More, and it is given
up."""
MOST_REQUESTS = 8
"""Requests of one page that are carried out at the same time."""


@dataclass(frozen=True)
class StationEnd:
    """What a browser's connection leads to.

    Args:
        window: The browser's way to drive, which outlives its connections.
        state: What to tell the page, as JSON's types.
        request: Carries out what the page asks for besides driving, see `telepresence.page.station.Station.request`.
        flooded: Called when the page sends more than any of ours does.
    """

    window: BrowserWindow
    state: Callable[[], dict[str, Any]]
    request: Callable[[str, Any], Awaitable[None]]
    flooded: Callable[[], None] = lambda: None


class BrowserMessages:
    """The messages of one connection. All of it belongs to one event loop.

    Args:
        send: Sends the browser a text of a kind: `drive`, `floor`, `state`, `ask`. What cannot leave at once is left
            out.
    """

    def __init__(self, end: StationEnd, send: Callable[[str, str], None]) -> None:
        self._window, self._state, self._request, self._send = end.window, end.state, end.request, send
        self._flooded = end.flooded
        self._takes: dict[str, Callable[[str | bytes], None]] = {
            "drive": self._on_drive,
            "floor": self._on_floor,
            "look": self._on_look,
            "ask": self._on_ask,
            "state": lambda _text: None,
        }
        self._requests: set[asyncio.Task] = set()
        self._seldom: dict[str, tuple[Any, float]] = {}
        self.settings: dict[str, Any] = {}
        """What the page has asked of the connection itself."""
        self._heard = time.monotonic()
        self._second, self._in_second = self._heard, 0
        self.flooding = False
        """Whether the page has sent more than any of ours does."""
        self.bad = 0
        """Messages that no page of ours sends."""

    @property
    def kinds(self) -> set[str]:
        """Kinds of messages that are taken: the names of WebRTC's channels."""
        return set(self._takes)

    @property
    def silent(self) -> bool:
        """Whether the page has said nothing for so long, or so much, that its connection is over."""
        return self.flooding or time.monotonic() - self._heard > SILENCE

    def count(self) -> bool:
        """Count one thing that the browser sends, and return whether it is to be heeded."""
        now = time.monotonic()
        if now - self._second >= 1.0:
            self._second, self._in_second = now, 0
        self._in_second += 1
        if self._in_second > MOST_PER_SECOND:
            self.give_up(f"more than {MOST_PER_SECOND} messages in a second")
        return not self.flooding

    def give_up(self, excess: str) -> None:
        """Heed nothing more of a page that sends more than any of ours does."""
        if not self.flooding:
            self.flooding = True
            self._window.let_go(time.monotonic())
            self._flooded()
            log.warning("a browser sends %s", excess)

    def receive(self, kind: str, text: str | bytes) -> None:
        """Take what the browser sends, whatever it is."""
        if not self.count():
            return
        try:
            if kind not in self._takes:
                raise BadMessage(f"there is no kind {kind[:40]!r}")
            self._takes[kind](text)
        except BadMessage as error:
            self.bad += 1
            if self.bad == 1:
                log.warning("a browser sends what no page of ours does: %s", error)

    def report(self, more: dict[str, Any]) -> None:
        """Send who drives, what the robot does, and `more`: what the connection itself knows."""
        state, now = self._state() | more, time.monotonic()
        for key in SELDOM & state.keys():
            value, sent = self._seldom.get(key, (None, -math.inf))
            if state[key] == value and now - sent < SELDOM_PERIOD:
                del state[key]
            else:
                self._seldom[key] = state[key], now
        self._send("state", _text(state))

    def say(self, text: str) -> None:
        """Show a sentence: drive_lease has refused something, or the account has ended."""
        self._answer(0, text)

    def let_go(self) -> None:
        """The connection is over: whatever the page holds is held no more."""
        self._window.let_go(time.monotonic())

    def _on_drive(self, text: str | bytes) -> None:
        message = parse_drive(text)
        self._heard = now = time.monotonic()
        if self._window.drive(message, now):
            self._send("drive", _text({"n": message.number}))

    def _on_floor(self, text: str | bytes) -> None:
        message = parse_floor(text)
        self._heard = now = time.monotonic()
        if self._window.point(message, now):
            self._send("floor", _text({"n": message.number}))

    def _on_look(self, text: str | bytes) -> None:
        self._window.look(parse_look(text), time.monotonic())

    def _on_ask(self, text: str | bytes) -> None:
        message = parse_ask(text)
        who = REQUESTS[message.action].who
        if who is Who.LEASE:
            self._window.ask(message)
            self._answer(message.number)  # what drive_lease refuses is said, what it does is in the state
        elif who is Who.CONNECTION:
            self.settings[message.action] = message.value
            self._answer(message.number)
        elif who is Who.DRIVER and not self._window.mine:
            self._answer(message.number, "Take the robot first.")
        elif len(self._requests) >= MOST_REQUESTS:
            self._answer(message.number, "The page asks for too much at once.")
        else:
            task = asyncio.ensure_future(self._carry_out(message))
            self._requests.add(task)
            task.add_done_callback(self._requests.discard)

    async def _carry_out(self, message: AskMessage) -> None:
        try:
            await self._request(message.action, message.value)
        except ValueError as error:
            self._answer(message.number, str(error))
        else:
            self._answer(message.number)

    def _answer(self, number: int, problem: str = "") -> None:
        self._send("ask", _text({"id": number, "ok": not problem, "text": problem}))


def _text(fields: dict[str, Any]) -> str:
    return json.dumps(fields, separators=(",", ":"))
