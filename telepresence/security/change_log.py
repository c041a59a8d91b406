"""Logs what changes, one line a second at most: a robot that changes its mind with every answer fills no disk."""

from __future__ import annotations

from collections.abc import Callable

PERIOD = 1.0
"""Seconds between two lines at least."""


class ChangeLog:
    """Remembers what was logged last. What changed too soon is logged later, if it still stands then.

    Args:
        text: What counts as logged already.
    """

    def __init__(self, text: str = "") -> None:
        self._logged = text
        self._due = 0.0

    def note(self, now: float, text: str, write: Callable[[str, str], None]) -> bool:
        """Note what is so `now` [s, monotonic], again and again; return True if it was logged.

        Args:
            write: Takes a format and the text, as rospy.loginfo does.
        """
        if text == self._logged or now < self._due:
            return False
        self._logged, self._due = text, now + PERIOD
        write("%s", text)
        return True

    def repeat(self) -> None:
        """Have the same text logged again when it is noted next."""
        self._logged = ""
