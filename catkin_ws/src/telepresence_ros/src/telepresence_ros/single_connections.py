"""One connection to each publisher of a topic, and no publisher without one. Two mistakes of rospy are mended here.

At every change the master tells a subscriber all publishers of the topic, and rospy gives each of them a thread that
connects unless there is a connection. When nodes start together, several threads of one publisher see none; each of
them connects then, and closes what the one before it is just opening, as the publisher does on its side. That leaves
tracebacks in both logs, and now and then no connection at all: the subscriber hears nothing from this publisher for as
long as both run. So they wait for each other here.

A publisher that registers while the master's answer to the subscriber is on its way is in a message that overtakes this
answer. rospy takes what came last for the newest and drops the other, and with it the publisher. Here what has not been
looked at yet is kept: a publisher that is not there any more refuses the connection, and nothing is lost.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from typing import Any

from rospy.impl.masterslave import ROSHandler
from rospy.impl.registration import RegManager

MOST = 2
"""Threads for one publisher of a topic: one that connects, and one that looks afterwards whether it has."""
NOTHING_TO_DO = 1, "", 0
"""What rospy's own returns for a publisher that is connected."""

_connect = ROSHandler._connect_topic
_lock = threading.Lock()
_turns: dict[tuple[str, str], tuple[threading.Lock, int]] = {}
"""(topic, publisher) -> whose turn it is, and how many threads want it."""


@contextlib.contextmanager
def _turn(key: tuple[str, str]) -> Iterator[bool]:
    """Wait for one's turn. False, at once, for whoever finds another one waiting already: that one does the same, later
    than now. A publisher that neither answers nor refuses keeps the first for ever, and the master names it again and
    again."""
    with _lock:
        turn, wanted = _turns.get(key, (threading.Lock(), 0))
        if wanted < MOST:
            _turns[key] = turn, wanted + 1
    if wanted >= MOST:
        yield False
        return
    try:
        with turn:
            yield True
    finally:
        with _lock:
            turn, wanted = _turns.pop(key)
            if wanted > 1:
                _turns[key] = turn, wanted - 1


def _connect_once(handler: Any, topic: str, publisher: str) -> Any:
    with _turn((topic, publisher)) as mine:
        return _connect(handler, topic, publisher) if mine else NOTHING_TO_DO


def _keep_publishers(manager: Any, topic: str, publishers: list[str]) -> None:
    """Note the publishers of a topic, and those that were noted before and wait."""
    with manager.cond:
        waiting = [publisher for name, noted in manager.updates if name == topic for publisher in noted]
        manager.updates.append((topic, list(dict.fromkeys([*publishers, *waiting]))))
        manager.cond.notify_all()


def connect_once() -> None:
    """Have rospy's subscribers in this process connect so. Call it before `rospy.init_node`; may be repeated."""
    ROSHandler._connect_topic = _connect_once
    RegManager.publisher_update = _keep_publishers
