"""Who asks for events of the whole application gets those, the last one first, until it has gone."""

import pytest
from PyQt5.QtCore import QEvent, QObject

from gui.application_events import filter_events
from gui.theme import application


class Listener(QObject):
    def __init__(self, name, heard, takes=False):
        super().__init__()
        self.name, self.heard, self.takes = name, heard, takes

    def eventFilter(self, watched, event):
        self.heard.append((self.name, event.type()))
        return self.takes


@pytest.fixture
def target(qt):
    return QObject()


def test_the_last_one_is_asked_first_and_may_keep_it(target):
    heard = []
    first, last = Listener("first", heard), Listener("last", heard)
    filter_events(first, QEvent.Type.User, QEvent.Type.Hide)
    filter_events(last, QEvent.Type.User)
    for kind in (QEvent.Type.User, QEvent.Type.Hide, QEvent.Type.Show):
        application().sendEvent(target, QEvent(kind))
    user, hide = QEvent.Type.User, QEvent.Type.Hide
    assert heard == [("last", user), ("first", user), ("first", hide)]
    last.takes = True
    application().sendEvent(target, QEvent(QEvent.Type.User))
    assert heard[3:] == [("last", user)]


def test_who_has_gone_is_not_asked(target):
    heard = []
    listener, deleted = Listener("collected", heard), Listener("deleted", heard)
    for one in (listener, deleted):
        filter_events(one, QEvent.Type.User)
    del listener, one
    deleted.deleteLater()
    application().sendPostedEvents(deleted, QEvent.Type.DeferredDelete)
    application().sendEvent(target, QEvent(QEvent.Type.User))
    assert heard == []
