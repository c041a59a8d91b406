"""ALExpressionWatcher: tells when conditions come true. Source: NAOqi 2.8 documentation, ALExpressionWatcher.

An expression is looked at as long as its client keeps the object that `add` answered.
"""

from __future__ import annotations

import logging
import threading
import time
import weakref
from typing import Any

from pepper_sim.naoqi import expressions
from pepper_sim.naoqi.expression_operators import true
from pepper_sim.naoqi.service import Service, ServiceError, one_of, remote
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_preference_manager import ALPreferenceManager
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.signals import Signal

log = logging.getLogger(__name__)

REPORT_CHANGE, REPORT_EDGE, REPORT_EDGE_TRUE = 0, 1, 2
PERIOD = 0.05
"""Seconds between two looks."""
_MOST = 1000


class _Surroundings:
    """The robot's memory and preferences, for expressions."""

    def __init__(self, memory: ALMemory, preferences: ALPreferenceManager) -> None:
        self._memory, self._preferences = memory, preferences
        self._raised: dict[str, int] = {}
        self._lock = threading.Lock()

    @property
    def now(self) -> float:
        return time.monotonic()

    def key(self, name: str) -> Any:
        return self._memory.read(name)

    def raised(self, name: str) -> int:
        with self._lock:
            known = name in self._raised
            count = self._raised.setdefault(name, 0)
        if not known:
            self._memory.follow(name, lambda _: self._count(name))
        return count

    def preference(self, domain: str, name: str) -> str | None:
        return self._preferences.getValue(domain, name)

    def _count(self, name: str) -> None:
        with self._lock:
            self._raised[name] += 1


class _Watched:
    """One expression, and the object that its client has."""

    def __init__(self, expression: str, mode: int, surroundings: _Surroundings) -> None:
        self._evaluate, self._surroundings = expressions.parse(expression), surroundings
        self._mode = mode
        self._lock = threading.Lock()
        self._value = self._evaluate(surroundings)
        self._signal = Signal("(m)")
        self.served = ServedObject()
        self.served.add_method("getValue", "m", "()", self._now)
        self.served.add_method("getExpression", "s", "()", lambda: expression)
        self.served.add_method("getReportMode", "i", "()", lambda: mode)
        self.served.add_signal("signal", self._signal)

    def look(self) -> None:
        """Evaluate the expression, and report what is to be reported."""
        with self._lock:
            before, self._value = self._value, self._evaluate(self._surroundings)
            value = self._value
        edge = true(before) != true(value)
        if {
            REPORT_CHANGE: before != value,
            REPORT_EDGE: edge,
            REPORT_EDGE_TRUE: edge and true(value),
        }[self._mode]:
            self._signal(value)

    def _now(self) -> Any:
        self.look()
        return self._value


class ALExpressionWatcher(Service):
    """Evaluates the expressions of clients, on a thread of its own while there are any."""

    name = "ALExpressionWatcher"

    def __init__(self, memory: ALMemory, preferences: ALPreferenceManager) -> None:
        self._surroundings = _Surroundings(memory, preferences)
        self._lock = threading.Lock()
        self._watched: list[weakref.ref[_Watched]] = []
        self._closing = threading.Event()
        self._running = False

    def close(self) -> None:
        """End the thread."""
        self._closing.set()

    @remote("o(si)")
    def add(self, expression: str, report_mode: int) -> Any:
        """Watches an expression; the object's signal fires at changes (0), edges (1) or when it comes true (2)."""
        one_of(report_mode, (REPORT_CHANGE, REPORT_EDGE, REPORT_EDGE_TRUE), "report_mode")
        watched = _Watched(expression, report_mode, self._surroundings)
        with self._lock:
            if len(self._watched) >= _MOST:
                raise ServiceError(f"there are {_MOST} expressions already")
            self._watched.append(weakref.ref(watched))
            begin, self._running = not self._running, True
        if begin:
            threading.Thread(target=self._run, name="expressions", daemon=True).start()
        return watched.served

    def _run(self) -> None:
        while not self._closing.wait(PERIOD):
            with self._lock:
                held = [(reference, reference()) for reference in self._watched]
                self._watched = [reference for reference, watched in held if watched is not None]
                if not self._watched:
                    self._running = False
                    return
            for _, watched in held:
                try:
                    if watched is not None:
                        watched.look()
                except Exception:  # one expression that fails must not end all the others
                    log.exception("an expression could not be evaluated")
            del held, watched
