"""However often there is something new, a widget is painted a few times a second."""

import time

from PyQt5.QtWidgets import QWidget

from gui.widgets.paced_updates import PacedUpdates

PERIOD = 100
"""[ms]"""
SOONEST = 0.09
"""[s] from one repaint to the next: Qt's timers may be early."""


class Counted(QWidget):
    painted = 0

    def paintEvent(self, event) -> None:
        self.painted += 1


def test_news_is_painted_at_once_and_what_comes_meanwhile_after_the_period(qt, spin):
    widget = Counted()
    widget.show()
    spin(lambda: widget.painted, "it is on the screen")
    updates, before = PacedUpdates(widget, PERIOD), widget.painted
    updates.ask()
    spin(lambda: widget.painted == before + 1, "the first news is painted")
    began = time.monotonic()

    def ask() -> bool:
        updates.ask()
        return widget.painted >= before + 10

    spin(ask, "the next ones are painted, too")
    assert widget.painted - before < (time.monotonic() - began) / SOONEST + 3, "not each of them"
    spin(lambda: not updates.isActive(), "it rests")
    count = widget.painted
    updates.ask()
    updates.ask()
    spin(lambda: not updates.isActive(), "it rests again")
    assert widget.painted == count + 2, "the last one was painted"
