"""Velocities that were ordered while the world was busy, and whose command is the base's newest.

Nobody who orders waits for a tick. Methods may be called from any thread.
"""

from __future__ import annotations

import threading
from collections import deque

from telepresence.geometry import Velocity


class VelocityOrders:
    """Velocities in base_footprint [m/s, m/s, rad/s], until whoever has the world takes them.

    Attributes:
        newest: Stands for the base's newest command; another one as soon as somebody else commands it.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()  # nobody holds it for longer than it takes to note a command
        self._waiting: deque[Velocity] = deque()
        self.newest: object = None

    @property
    def waiting(self) -> bool:
        return bool(self._waiting)

    def add(self, velocity: Velocity) -> object:
        """Note a velocity; return what stands for this command."""
        with self._lock:
            return self._add(velocity)

    def replace(self, command: object, velocity: Velocity) -> object | None:
        """Note a velocity as `add` does; None, and nothing is noted, if `command` is not the newest any more."""
        with self._lock:
            return self._add(velocity) if self.newest is command else None

    def supersede(self) -> None:
        """Something else than a velocity commands the base from now on."""
        self.newest = object()

    def take(self) -> Velocity | None:
        """Return the oldest velocity that waits, and remove it."""
        return self._waiting.popleft() if self._waiting else None

    def clear(self) -> None:
        self._waiting.clear()

    def _add(self, velocity: Velocity) -> object:
        self._waiting.append(velocity)
        self.newest = velocity
        return velocity
