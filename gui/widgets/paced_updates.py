"""Repaints a widget a few times a second at most, however often there is something new to show."""

from __future__ import annotations

from PyQt5.QtCore import QTimer
from PyQt5.QtWidgets import QWidget


class PacedUpdates(QTimer):
    """What is new after a rest is painted at once, what comes meanwhile when the period is over.

    Args:
        widget: Is repainted.
        period: [ms] between two repaints.
    """

    def __init__(self, widget: QWidget, period: int) -> None:
        super().__init__(widget)
        self._widget, self._asked = widget, False
        self.setSingleShot(True)
        self.setInterval(period)
        self.timeout.connect(self._on_timeout)

    def ask(self) -> None:
        """There is something new to show."""
        if self.isActive():
            self._asked = True
            return
        self._widget.update()
        self.start()

    def _on_timeout(self) -> None:
        if self._asked:
            self._asked = False
            self.ask()
