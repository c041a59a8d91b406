"""OwnerConsent: what the robot's owner has agreed to on the robot's own page, never a program."""

from __future__ import annotations

from collections.abc import Callable


class OwnerConsent:
    """Whether programs may switch safety reflexes off; refused unless the owner says otherwise. Any thread.

    Args:
        given: Whether the owner has consented before the robot starts.
        on_withdrawal: Switches every reflex on again; called when the consent ends.
    Source: NAOqi 2.8 documentation, reflexes-external-collision-api and reflexes-fall-manager-api.
    """

    def __init__(self, given: bool, on_withdrawal: Callable[[], None]) -> None:
        self._at_start = self._given = given
        self._on_withdrawal = on_withdrawal

    @property
    def given(self) -> bool:
        return self._given

    @given.setter
    def given(self, given: bool) -> None:
        self._given = given
        if not given:
            self._on_withdrawal()

    def reset(self) -> None:
        """Return to the start, with every reflex on."""
        self._given = self._at_start
        self._on_withdrawal()
