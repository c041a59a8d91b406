"""A timer that calls one function again and again, on Qt's thread."""

from __future__ import annotations

from collections.abc import Callable

from PyQt5.QtCore import QObject, Qt, QTimer


class PeriodicTimer(QTimer):
    """A timer that is made stopped; call `start` to run it.

    Args:
        period: [ms] between two calls.
        action: What to call.
        owner: The timer ends with it.
        precise: Keep the period to the millisecond; otherwise Qt may deviate by 5 % to wake up less often.
    """

    def __init__(self, period: int, action: Callable[[], None], owner: QObject, precise: bool = False) -> None:
        super().__init__(owner)
        self.setInterval(period)
        if precise:
            self.setTimerType(Qt.TimerType.PreciseTimer)
        self.timeout.connect(action)
