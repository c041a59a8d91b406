"""Takes back what the window shows of a robot when nobody says it any more: a value that was true once looks like one
that is. What repeats itself grows old in its own widget; here is what is said only when it changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject

from gui.window import NO_TABLET

if TYPE_CHECKING:
    from gui.ros.link import RosLink
    from gui.window import OperatorWindow

SAID_ONCE = ("voice_state", "voice_settings", "drive_state", "page")
"""Channels on which a program speaks only when something changes, and to whoever comes later (latched topics)."""
WATCHED = (*SAID_ONCE, "tablet")


class LastValues(QObject):
    """Watches who speaks.

    Args:
        window, link: What shows it, and what receives it.
    """

    def __init__(self, window: OperatorWindow, link: RosLink) -> None:
        super().__init__(window)
        self._window, self._link = window, link
        self._watched = [name for name in WATCHED if link.has(name)]
        self._found: frozenset[str] = frozenset()
        self._connected: frozenset[str] = frozenset()
        self._driver = False
        self._left: set[str] = set()
        """What is not subscribed to, because nobody published it."""
        link.looked.connect(self._look)

    def clear(self) -> None:
        """Show nothing of what this robot has said: it is for somebody else from now on."""
        self._window.health.clear()
        self._window.gate.clear()
        self._window.bodyPanel.clear()
        self._window.around.clear()
        self._window.robotPanel.answer("")
        self._forget_sound()
        self._forget_driver()
        self._forget_tablet()

    def _look(self) -> None:
        """Find out who has fallen silent: whoever the master does not list any more, or is killed, which ends the
        connection although the master still lists it."""
        found, driver = self._link.found.intersection(self._watched), self._link.state.driver
        connected = frozenset(name for name in self._watched if self._link.publishers(name))
        gone = (self._found - found) | (self._connected - connected)
        if "voice_state" in gone:
            self._forget_sound()
        if "drive_state" in gone or (self._driver and not driver):
            self._forget_driver()
        if gone & {"tablet", "page"}:
            self._forget_tablet()
        for name in SAID_ONCE:
            self._subscribe_anew(name, found)  # the tablet's picture is subscribed to when it is looked at
        self._found, self._connected, self._driver = found, connected, driver

    def _subscribe_anew(self, name: str, found: frozenset[str]) -> None:
        """Leave a topic that nobody publishes, and come back with its publisher: it then says again what it had said,
        even if it lives on while the master, or our knowledge of it, was away."""
        if name in self._found and name not in found:
            self._left.add(name)
            self._link.watch(name, False)
        elif name in self._left and name in found:
            self._left.remove(name)
            self._link.watch(name, True)

    def _forget_sound(self) -> None:
        self._window.sound.set_available(False)

    def _forget_driver(self) -> None:
        self._window.aroundLabel.setText("")
        self._window.aroundLabel.setToolTip("")

    def _forget_tablet(self) -> None:
        self._window.tablet.clear(*NO_TABLET)
