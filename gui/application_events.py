"""Events of the whole application, for those who must see them wherever the keyboard or the mouse is.

Qt asks a filter of the application about every event of every widget, thousands a second while pictures are painted.
One filter in Python looks at their kinds, and only what somebody wants costs more than that.
"""

from __future__ import annotations

import weakref

from PyQt5 import sip
from PyQt5.QtCore import QEvent, QObject

from gui.theme import application


class _Events(QObject):
    """The filter of the application; asks those that were added last first, as Qt does."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._wanted: dict[int, list[weakref.ref[QObject]]] = {}

    def add(self, one: QObject, kinds: tuple[QEvent.Type, ...]) -> None:
        for kind in kinds:
            self._wanted.setdefault(int(kind), []).insert(0, weakref.ref(one))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        for reference in self._wanted.get(event.type(), ()):
            one = reference()
            if one is not None and not sip.isdeleted(one) and one.eventFilter(watched, event):
                return True
        return False


def filter_events(one: QObject, *kinds: QEvent.Type) -> None:
    """Have `one` asked about events of these kinds in the whole application, as long as it lives."""
    events = application().findChild(_Events)
    if events is None:
        events = _Events(application())
        application().installEventFilter(events)
    events.add(one, kinds)
