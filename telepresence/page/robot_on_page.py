"""One robot as the pilot's page shows it: its pictures, its conversation, and the pages that look at it."""

from __future__ import annotations

from collections.abc import Callable, Collection

from telepresence.page.browser_conversation import RobotConversation
from telepresence.page.browser_window import BrowserWindow
from telepresence.page.pictures import Pictures
from telepresence.page.station import Station
from telepresence.page.tabs import Tab
from telepresence.teleop.lease_topics import LeaseState


class RobotOnPage:
    """One robot: its pictures, and the tabs that are windows of its drive_lease."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.pictures = Pictures(station.picture, station.watch)
        self.conversation = RobotConversation(station.conversation)
        self.windows: dict[Tab, BrowserWindow] = {}
        self.lease: LeaseState | None = None
        self._looking: list[str] | None = None  # what a program before this one has said, nobody here knows

    def note_who_looks(self, connected: Collection[Tab]) -> None:
        """Say who looks at the robot, when that has changed."""
        looking = sorted({tab.sign_in.account.name for tab in self.windows if tab in connected})
        if looking != self._looking:
            self._looking = looking
            self.station.show_who_looks(looking)

    def window(self, tab: Tab, say: Callable[[str], None]) -> BrowserWindow:
        """Return this page's way to drive; it outlives connections."""
        if tab not in self.windows:
            link, account = self.station.lease_link(tab.name), tab.sign_in.account
            window = BrowserWindow(link, account, say, self.station.floor)
            self.windows[tab] = window
            if self.lease is not None:
                window.receive(self.lease)
        return self.windows[tab]

    def leave(self, tab: Tab) -> None:
        """This page does not look at the robot any more."""
        if tab in self.windows:
            self.windows.pop(tab).end()
