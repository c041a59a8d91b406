"""However often there is something new, a widget is painted a few times a second."""

from PyQt5.QtWidgets import QWidget

from gui.widgets.paced_updates import PacedUpdates

PERIOD = 100


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
    asked = 0

    def ask() -> bool:
        nonlocal asked
        updates.ask()
        asked += 1
        return widget.painted >= before + 3

    spin(ask, "the next ones are painted, too")
    assert asked > widget.painted - before + 2, "not each of them"
    updates.ask()
    spin(lambda: not updates.isActive(), "it rests")
    assert widget.painted == before + 4, "the last one was painted"
