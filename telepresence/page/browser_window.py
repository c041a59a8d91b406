"""One browser as a window of drive_lease: what its page sends becomes signed commands.

The browser's own clock dates the commands, so that the lease's rule about late ones covers the whole way; therefore
nothing is sent to the lease that does not come from the page, signs of life neither.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from telepresence.geometry import ZERO_VELOCITY
from telepresence.page.commands import AskMessage, DriveMessage
from telepresence.teleop.lease_client import LeaseClient, LeaseLink
from telepresence.teleop.lease_messages import Account
from telepresence.teleop.lease_topics import LeaseState

SILENCE = 0.25
"""[s] without a message after which a browser that drove is stopped here; the lease would, 0.05 s later."""
MOST_PER_SECOND = 40
"""Messages of the channel `drive`: twice what the page sends."""


class BrowserWindow:
    """A browser's way to drive. All of it belongs to one event loop.

    Args:
        link: To drive_lease, under a node name of its own.
        say: Sends the browser a sentence: a request was refused, or the account has ended.
    """

    def __init__(self, link: LeaseLink, account: Account, say: Callable[[str], None]) -> None:
        self._client = LeaseClient(link, lambda: None, say, self._on_ended, own_clock=False)
        self._say = say
        self._number = 0
        self._newest: tuple[DriveMessage, float] | None = None
        self._second, self._in_second = -math.inf, 0
        self.refused = 0
        """Messages that were not passed on: repeated, too many."""
        self.over = ""
        """Why this account acts no more; empty while it does."""
        self._client.sign_in(account)

    @property
    def mine(self) -> bool:
        """Whether this browser has the robot."""
        return self._client.mine

    def obstacle(self) -> str:
        """Return why this browser may not drive and what to do about it; empty when it may."""
        return self._client.obstacle()

    def describe(self) -> dict[str, Any]:
        """Return what the page shows about who drives, as JSON's types."""
        state = self._client.state
        return {
            "mine": self.mine,
            "obstacle": self.obstacle(),
            "pilot": state.pilot if state else "",
            "asking": state.asking if state else "",
            "stopped_by": state.stopped_by if state else "",
            "hold": state.hold if state else "",
        }

    def receive(self, state: LeaseState) -> None:
        """Take what drive_lease says."""
        self._client.receive(state)

    def check(self, now: float) -> None:
        """Stop what a silent browser drives, and look whether drive_lease is silent; twenty times a second."""
        self._client.check()
        if self._newest is not None and now - self._newest[1] > SILENCE:
            self.let_go(now)

    def let_go(self, now: float) -> None:
        """Nobody holds anything any more: the connection has ended."""
        newest, self._newest = self._newest, None
        if newest is not None and newest[0].velocity is not None:
            message, came = newest
            self._client.command(ZERO_VELOCITY, message.hold, message.sent + now - came)

    def drive(self, message: DriveMessage, now: float) -> bool:
        """Pass a command on; whether it was. `now` [s]: our clock."""
        if now - self._second >= 1.0:
            self._second, self._in_second = now, 0
        self._in_second += 1
        if message.number <= self._number or self._in_second > MOST_PER_SECOND:
            self.refused += 1
            return False
        self._number = message.number
        self._newest = message, now
        self._client.command(message.velocity, message.hold, message.sent)
        return True

    def ask(self, message: AskMessage) -> None:
        """Make a request."""
        if message.action == "take":
            self._client.take()
        elif message.action == "release":
            self._client.release()
        else:
            self._client.ask(message.action, message.to)

    def end(self) -> None:
        """The browser has gone."""
        self._client.sign_out()

    def _on_ended(self, reason: str) -> None:
        self.over = reason
        self._say(reason)
