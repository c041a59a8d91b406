"""The pages of all browsers and their connections: how many there may be, and which one makes room for which.

A tab outlives its connections: after a cut it dials again, and is the same window of drive_lease.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass

from aiohttp import web

from telepresence.page.attempts import Attempts
from telepresence.page.browser_link import BrowserLink
from telepresence.page.browser_socket import BrowserSocket
from telepresence.page.sign_ins import SignIn
from telepresence.teleop.accounts import is_guest_name

BROWSER_KEPT = 10.0
"""[s] for which a page without a connection stays a window of drive_lease: it may dial again."""
MOST_TABS = 4
"""Pages of one sign-in: the one that was heard last longest ago ends."""
_NUMBER = re.compile("[0-9a-f]{16}")
DIALS = (40, 10.0)
"""Connections of one sign-in in so many seconds, of all its pages. Each costs keys and sockets."""
NEW_TABS = (20, 10.0)
"""Pages that one sign-in opens in so many seconds. Each is a window of drive_lease, which proves itself."""
FLOODS = (1, 5.0)
"""Connections of one sign-in that are given up for sending too much, in so many seconds: then it dials in vain."""
MOST_LINKS = 16
"""Browsers that are connected at the same time."""


@dataclass(eq=False)
class Tab:
    """One page of a browser.

    Attributes:
        name: Names it, as a node does a window: for others to see, and no secret.
        used: When it was last connected [monotonic s].
        refused: How many of its messages were, as far as that is in the audit.
        attempt: Number of its newest offer, or websocket.
    """

    sign_in: SignIn
    number: str
    used: float
    refused: int = 0
    attempt: float = 0.0

    @property
    def name(self) -> str:
        return f"{self.sign_in.name}_{self.number}"


class Tabs:
    """Belongs to one event loop.

    Args:
        holds: Whether a sign-in still holds.
        drives: Whether a tab drives a robot.
        leave: Called with a tab that is forgotten.
    Attributes:
        all: By sign-in and number.
        links: The connection of each tab that has one, the newest last.
    """

    def __init__(
        self, holds: Callable[[SignIn], bool], drives: Callable[[Tab], bool], leave: Callable[[Tab], None]
    ) -> None:
        self._holds, self._drives, self._leave = holds, drives, leave
        self.all: dict[tuple[SignIn, str], Tab] = {}
        self.links: dict[Tab, BrowserLink | BrowserSocket] = {}
        self._dials, self._new_tabs, self._floods = Attempts(*DIALS), Attempts(*NEW_TABS), Attempts(*FLOODS)

    async def open(self, sign_in: SignIn, number: str) -> Tab:
        """Return the tab of this number, a new one if need be. Raises HTTPException."""
        if not _NUMBER.fullmatch(number):
            raise web.HTTPBadRequest(reason="A page's name has 16 hexadecimal digits.")
        if not self._holds(sign_in):  # it has ended while the body came
            raise web.HTTPUnauthorized(reason="Sign in first.")
        now = time.monotonic()
        if (sign_in, number) not in self.all:
            if self._new_tabs.wait(sign_in.name, now):
                raise web.HTTPTooManyRequests(reason="Too many pages are opened.")
            self._new_tabs.note(sign_in.name, now)
            others = sorted(self._tabs_of(sign_in), key=lambda tab: tab.used)
            for tab in others[: max(0, len(others) - MOST_TABS + 1)]:
                await self.forget(tab)
        tab = self.all.setdefault((sign_in, number), Tab(sign_in, number, now))
        tab.used = now
        return tab

    async def make_room(self, tab: Tab, attempt: float) -> None:
        """Make room for a connection: end what this tab has had before, or a guest's. Raises HTTPException."""
        if self._floods.wait(tab.sign_in.name, time.monotonic()):
            raise web.HTTPTooManyRequests(reason="This page has sent too much. It may dial again in some seconds.")
        if self._dials.wait(tab.sign_in.name, time.monotonic()):
            raise web.HTTPTooManyRequests(reason="This page dials too often.")
        self._dials.note(tab.sign_in.name, time.monotonic())
        if not attempt > tab.attempt:  # after a cut, what was sent in it comes late
            raise web.HTTPConflict(reason="A later attempt was here first.")
        tab.attempt = attempt
        if tab in self.links:  # what the old connection still delivers is late
            await self._end_link(tab, tab, attempt)
        while len(self.links) >= MOST_LINKS:
            newest = (other for other in reversed(self.links) if is_guest_name(other.sign_in.account.name))
            guests = sorted(newest, key=self._drives)  # who drives goes last
            if is_guest_name(tab.sign_in.account.name) or not guests:
                raise web.HTTPServiceUnavailable(reason=f"{MOST_LINKS} browsers are connected, which is the limit.")
            await self._end_link(guests[0], tab, attempt)  # guests of one link keep nobody out who has an account

    def note_flood(self, tab: Tab) -> None:
        """A connection of this tab was given up because it sent too much."""
        self._floods.note(tab.sign_in.name, time.monotonic())

    def note_end(self, link: BrowserLink | BrowserSocket) -> None:
        """A connection has ended."""
        for tab, one in list(self.links.items()):
            if one is link:
                del self.links[tab]

    async def forget(self, tab: Tab) -> None:
        self.all.pop((tab.sign_in, tab.number), None)
        link = self.links.pop(tab, None)
        if link is not None:
            await link.close()
        self._leave(tab)

    async def forget_all_of(self, sign_in: SignIn) -> None:
        for tab in self._tabs_of(sign_in):
            await self.forget(tab)

    async def forget_gone(self, now: float) -> None:
        """Forget tabs that have had no connection for `BROWSER_KEPT`."""
        for tab in list(self.all.values()):
            if tab not in self.links and now - tab.used > BROWSER_KEPT:
                await self.forget(tab)

    def _tabs_of(self, sign_in: SignIn) -> list[Tab]:
        return [tab for tab in self.all.values() if tab.sign_in is sign_in]

    async def _end_link(self, ended: Tab, tab: Tab, attempt: float) -> None:
        """Make room for this attempt of a tab, unless it is over by the time. Raises HTTPConflict."""
        await self.links.pop(ended).close()
        if tab.attempt != attempt:
            raise web.HTTPConflict(reason="A later attempt was here first.")
        if self.all.get((tab.sign_in, tab.number)) is not tab:
            raise web.HTTPConflict(reason="This page was closed while it dialled.")
