"""Extractor: a module that runs while somebody is subscribed to it (NAOqi 2.8 documentation, ALExtractor)."""

from __future__ import annotations

import threading
from typing import ClassVar

from pepper_sim.naoqi.service import Module, ServiceError, remote, within
from pepper_sim.services.al_memory import ALMemory

DEFAULT_PERIOD, DEFAULT_PRECISION = 30, 1.0
_MAX_SUBSCRIBERS = 1000


class Extractor(Module):
    """Base of the extractors. A subclass names its events."""

    events: ClassVar[tuple[str, ...]] = ()

    def __init__(self, memory: ALMemory) -> None:
        self.memory = memory
        self._subscribers: dict[str, tuple[int, float]] = {}
        self._subscribers_lock = threading.Lock()
        memory.declare(self.events, self.name)
        memory.start_with(
            self.name, lambda module, wanted: self.subscribe(module) if wanted else self.unsubscribe(module)
        )

    @property
    def active(self) -> bool:
        """Whether anybody has subscribed."""
        return bool(self._subscribers)

    def subscribers_changed(self) -> None:
        """Called when somebody has subscribed or unsubscribed."""

    @remote("v(s)", "v(sif)")
    def subscribe(self, name: str, period: int = DEFAULT_PERIOD, precision: float = DEFAULT_PRECISION) -> None:
        """Switches the extractor on for `name`; period in ms, precision 0 to 1."""
        with self._subscribers_lock:
            if len(self._subscribers) >= _MAX_SUBSCRIBERS and name not in self._subscribers:
                raise ServiceError(f"there are {_MAX_SUBSCRIBERS} subscribers already")
            self._subscribers[name] = (max(1, period), within(precision, 0.0, 1.0, "precision"))
        self.subscribers_changed()

    @remote("v(s)")
    def unsubscribe(self, name: str) -> None:
        """Ends the subscription of `name`. An unknown name is no error: it may have ended by itself."""
        with self._subscribers_lock:
            self._subscribers.pop(name, None)
        self.subscribers_changed()

    @remote("v(si)")
    def updatePeriod(self, name: str, period: int) -> None:
        """Changes the period of `name` [ms]."""
        _, precision = self._of(name)
        self._subscribers[name] = (max(1, period), precision)

    @remote("v(sf)")
    def updatePrecision(self, name: str, precision: float) -> None:
        """Changes the precision of `name`."""
        period, _ = self._of(name)
        self._subscribers[name] = (period, within(precision, 0.0, 1.0, "precision"))

    @remote("i()")
    def getCurrentPeriod(self) -> int:
        """Returns the shortest period that a subscriber requested [ms]."""
        return min((period for period, _ in list(self._subscribers.values())), default=DEFAULT_PERIOD)

    @remote("f()")
    def getCurrentPrecision(self) -> float:
        """Returns the highest precision that a subscriber requested."""
        return max((precision for _, precision in list(self._subscribers.values())), default=DEFAULT_PRECISION)

    @remote("i(s)")
    def getMyPeriod(self, name: str) -> int:
        """Returns the period of `name` [ms]."""
        return self._of(name)[0]

    @remote("f(s)")
    def getMyPrecision(self, name: str) -> float:
        """Returns the precision of `name`."""
        return self._of(name)[1]

    @remote("m()")
    def getSubscribersInfo(self) -> list[list]:
        """Lists [name, period, precision]."""
        return [[name, period, precision] for name, (period, precision) in list(self._subscribers.items())]

    @remote("[s]()")
    def getEventList(self) -> list[str]:
        """Lists the events the extractor raises."""
        return list(self.events)

    @remote("[s]()")
    def getOutputNames(self) -> list[str]:
        """Old name of getEventList."""
        return list(self.events)

    @remote("[s]()")
    def getMemoryKeyList(self) -> list[str]:
        """Lists the keys the extractor writes."""
        return list(self.events)

    def _of(self, name: str) -> tuple[int, float]:
        if name not in self._subscribers:
            raise ServiceError(f"'{name[:60]}' has not subscribed")
        return self._subscribers[name]
