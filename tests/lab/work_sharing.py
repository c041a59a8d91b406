"""A pytest plugin: which worker of `./stack test` runs which files, in which order, and who goes first.

One worker has every whole station, so that there is one at a time; one has the browsers, one the other windows. The
fourth takes, and the others when they are through, files with ROS nodes, which need the processors, and files that
mostly wait, in turn.
"""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
STATIONS, BROWSERS, WINDOWS = CHAINS = ("stations", "browsers", "windows")
"""Kinds of files of which one worker runs all."""
NODES, OTHERS = "nodes", "others"
"""The others: each file goes to whoever is free."""
ORDER = (*CHAINS, NODES, OTHERS)
MARKERS = {"alone": STATIONS, "station": STATIONS, "browser": BROWSERS, "x11": WINDOWS, "ros": NODES}
UP_FRONT = {STATIONS, BROWSERS}
"""They run in real time: the sooner a station gets the processors, the less it costs, and a page that does not run for
half a second lets go of what is held."""
BEHIND = 5
"""Niceness of all others."""
TURNS = pytest.StashKey["Turns"]()


class Turns:
    """Workers run tests side by side, but for a test that is marked `alone`: nothing else runs with that.

    Two locks, on files that all workers have: the queue, where everybody waits, and the machine. Whoever is to be
    alone holds the queue until the others have left the machine, so nobody waits for ever.
    """

    def __init__(self) -> None:
        self._queue, self._machine = os.open(__file__, os.O_RDONLY), os.open(TESTS, os.O_RDONLY)
        self.alone = False

    def enter(self, alone: bool) -> None:
        fcntl.flock(self._queue, fcntl.LOCK_EX)
        fcntl.flock(self._machine, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        fcntl.flock(self._queue, fcntl.LOCK_UN)
        self.alone = alone

    def leave(self) -> None:
        fcntl.flock(self._machine, fcntl.LOCK_UN)
        self.alone = False


def pytest_configure(config: pytest.Config) -> None:
    if hasattr(config, "workerinput"):
        config.stash[TURNS] = Turns()


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    kinds: dict[Path, str] = {}
    for item in items:
        kind = _kind(item)
        kinds[item.path] = min(kinds.get(item.path, kind), kind, key=ORDER.index)
    for item in items:
        kind = kinds[item.path]
        item.add_marker(pytest.mark.xdist_group(kind if kind in CHAINS else str(item.path)))
    if hasattr(config, "workerinput"):
        place = {file: number for number, file in enumerate(_in_order(kinds))}
        items.sort(key=lambda item: place[item.path])


def _in_order(kinds: dict[Path, str]) -> list[Path]:
    of = {kind: [file for file in kinds if kinds[file] == kind] for kind in ORDER}
    turns = [file for pair in itertools.zip_longest(of[NODES], of[OTHERS]) for file in pair if file]
    return [*of[STATIONS], *of[BROWSERS], *of[WINDOWS], *turns]


def _kind(item: pytest.Item) -> str:
    return next((kind for marker, kind in MARKERS.items() if item.get_closest_marker(marker)), OTHERS)


@pytest.hookimpl(wrapper=True, tryfirst=True)  # around the time limit and the second try
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    turns = item.config.stash.get(TURNS, None)
    if turns is None:
        return (yield)
    group = item.get_closest_marker("xdist_group").args[0]
    with contextlib.suppress(PermissionError):  # nobody but root comes back to the front
        os.setpriority(os.PRIO_PROCESS, 0, 0 if group in UP_FRONT else BEHIND)
    alone = item.get_closest_marker("alone") is not None
    if not turns.alone:
        turns.enter(alone)
    try:
        return (yield)
    finally:
        # One after the other, without waiting for a turn again.
        if not (alone and nextitem is not None and nextitem.get_closest_marker("alone")):
            turns.leave()
