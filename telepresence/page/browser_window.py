"""One browser as a window of drive_lease: what its page sends becomes signed commands.

The browser's own clock dates the commands, so that the lease's rule about late ones covers the whole way; therefore
nothing is sent to the lease that does not come from the page, signs of life neither.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from telepresence.geometry import ZERO_VELOCITY
from telepresence.page.attempts import Attempts
from telepresence.page.commands import AskMessage, DriveMessage, FloorMessage, LookMessage
from telepresence.page.floor import BrowserFloor, Floor
from telepresence.teleop.lease_client import LeaseClient
from telepresence.teleop.lease_link import LeaseLink
from telepresence.teleop.lease_messages import PILOT, Account
from telepresence.teleop.lease_topics import LeaseState

SILENCE = 0.25
"""[s] without a message after which a browser that drove is stopped here; the lease would, 0.05 s later."""
MOST_PER_SECOND = 40
"""Messages of the channel `drive`, and of `look`: twice what the page sends."""
ASKS, STOPS = (10, 2.0), (4, 2.0)
"""Requests, and presses of the red stop, in so many seconds; each is a call of drive_lease."""
STOP_KEPT = 3.0
"""[s] for which a press of the red stop waits until the window has joined drive_lease."""


class Numbered:
    """The messages of one channel: each newer than the one before, and not too many."""

    def __init__(self) -> None:
        self._newest = 0
        self._second, self._in_second = -math.inf, 0

    def admit(self, number: int, now: float) -> bool:
        """Whether a message counts that comes `now` [s]."""
        if now - self._second >= 1.0:
            self._second, self._in_second = now, 0
        self._in_second += 1
        if number <= self._newest or self._in_second > MOST_PER_SECOND:
            return False
        self._newest = number
        return True


class BrowserWindow:
    """A browser's way to drive. All of it belongs to one event loop.

    Args:
        link: To drive_lease, under a node name of its own.
        say: Sends the browser a sentence: a request was refused, or the account has ended.
        floor: What the robot sees of it; None where it cannot be driven to a place.
    """

    def __init__(
        self, link: LeaseLink, account: Account, say: Callable[[str], None], floor: Floor | None = None
    ) -> None:
        self._floor = BrowserFloor(floor) if floor is not None else None
        self._client = LeaseClient(link, lambda: None, say, self._on_ended, own_clock=False)
        self._account, self._say = account, say
        self.node = link.node_name
        """Name by which drive_lease knows this window."""
        self._asks = {False: Attempts(*ASKS), True: Attempts(*STOPS)}
        self._commands, self._looks = Numbered(), Numbered()
        self._newest: tuple[DriveMessage, float] | None = None
        self._stop_until: float | None = None
        """How long a press of the red stop waits [s]; None for none."""
        self.refused = 0
        """Messages that were not passed on: repeated, too many, a watcher's."""
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
            "joined": bool(self._client.session),
            "obstacle": self.obstacle(),
            "pilot": state.pilot if state else "",
            "asking": state.asking if state else "",
            "stopped_by": state.stopped_by if state else "",
            "hold": state.hold if state else "",
            "way": self._floor.way() if self._floor else None,
        }

    def receive(self, state: LeaseState) -> None:
        """Take what drive_lease says."""
        self._client.receive(state)
        obstacle = self.obstacle()
        if self._floor is not None and obstacle and self._floor.let_go():
            self._say(obstacle)  # it may have passed before the page is told of it, and its hand still holds

    def check(self, now: float) -> None:
        """Stop what a silent browser drives, and look whether drive_lease is silent; twenty times a second."""
        self._client.check()
        if self._stop_until is not None and (self._client.session or now > self._stop_until):
            self._stop_until = None
            self._client.ask("stop")
        if self._newest is not None and now - self._newest[1] > SILENCE:
            self._stand(now)  # a place on the floor stays held: the page ends that itself when it cannot know any more

    def let_go(self, now: float) -> None:
        """Nobody holds anything any more: the connection has ended."""
        if self._floor is not None:
            self._floor.let_go()
        self._stand(now)

    def _stand(self, now: float) -> None:
        newest, self._newest = self._newest, None
        if newest is not None and newest[0].velocity is not None:
            message, came = newest
            self._client.command(ZERO_VELOCITY, message.hold, message.sent + now - came)

    def drive(self, message: DriveMessage, now: float) -> bool:
        """Pass a command on; whether it was. `now` [s]: our clock."""
        if not self._is_next(message.number, now):
            return False
        if self._floor is not None:
            self._floor.let_go()
        self._pass_on(message, now)
        return True

    def point(self, message: FloorMessage, now: float) -> bool:
        """Drive to the place in the picture that is held; whether the message was taken. `now` [s]: our clock."""
        if self._floor is None or not self._is_next(message.number, now):
            return False
        step = self._floor.step(message, now, self.obstacle())
        if step.refused:
            self._say(step.refused)
        self._pass_on(DriveMessage(message.number, message.sent, step.velocity, message.hold), now)
        return True

    def _is_next(self, number: int, now: float) -> bool:
        if self._commands.admit(number, now):
            return True
        self.refused += 1
        return False

    def _pass_on(self, message: DriveMessage, now: float) -> None:
        if self._account.role != PILOT and message.velocity is not None:
            self.refused += 1
            message = replace(message, velocity=None)
        self._newest = message, now
        self._client.command(message.velocity, message.hold, message.sent)

    def look(self, message: LookMessage, now: float) -> None:
        """Pass on where somebody wants to look. `now` [s]: our clock."""
        if self.mine and self._looks.admit(message.number, now):
            self._client.look(message.look, message.sent)
        else:
            self.refused += 1

    def ask(self, message: AskMessage) -> None:
        """Make a request; whoever watches may press the red stop, and nothing else.

        The red stop waits until the window has joined: its page may just have come, or have been forgotten.
        """
        stop, now = message.action == "stop", time.monotonic()
        if self._account.role != PILOT and not stop:
            self.refused += 1
            self._say(f"{self._account.name} may watch, not drive.")
            return
        state = self._client.state
        stops_a_free_robot = stop and state is not None and not state.stopped_by  # which nobody can do often
        if self._asks[stop].wait("", now) and not stops_a_free_robot:
            self.refused += 1
            return
        self._asks[stop].note("", now)
        if stop and not self._client.session:
            self._stop_until = now + STOP_KEPT
        elif message.action == "take":
            self._client.take()
        elif message.action == "release":
            self._client.release()
        else:
            self._client.ask(message.action, message.value or "")

    def end(self) -> None:
        """The browser has gone."""
        self._client.sign_out()

    def _on_ended(self, reason: str) -> None:
        self.over = reason
        self._say(reason)
