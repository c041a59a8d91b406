"""ALBehaviorManager: installed and running behaviours.

A behaviour is a program for the robot's own engine, which is not simulated: an installed one can be started, is listed
as running until it is stopped, and moves nothing. `runBehavior` ends at once.
"""

from __future__ import annotations

import concurrent.futures
import threading

from pepper_sim.naoqi.installed_packages import InstalledPackages
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown
from telepresence.naoqi.signals import Signal


class ALBehaviorManager(Module):
    """Starts and stops installed behaviours."""

    name = "ALBehaviorManager"

    def __init__(self, packages: InstalledPackages) -> None:
        self._packages = packages
        self._lock = threading.Lock()
        self._running: dict[str, concurrent.futures.Future | None] = {}
        self.behaviorStarted = Signal("(s)")
        self.behaviorStopped = Signal("(s)")
        self.behaviorsAdded = Signal("([s])")
        self.behaviorsRemoved = Signal("([s])")

    @remote("[s]()")
    def getInstalledBehaviors(self) -> list[str]:
        """Lists the installed behaviours."""
        return self._packages.behaviors

    @remote("[s]()")
    def getBehaviorNames(self) -> list[str]:
        """Lists the installed behaviours (older name)."""
        return self._packages.behaviors

    @remote("b(s)")
    def isBehaviorInstalled(self, name: str) -> bool:
        """Whether a behaviour is installed."""
        return name in self._packages.behaviors

    @remote("b(s)")
    def isBehaviorPresent(self, prefixedBehavior: str) -> bool:
        """Whether a behaviour is installed (older name)."""
        return prefixedBehavior in self._packages.behaviors

    @remote("[s]()")
    def getRunningBehaviors(self) -> list[str]:
        """Lists the running behaviours."""
        with self._lock:
            return list(self._running)

    @remote("b(s)")
    def isBehaviorRunning(self, behavior: str) -> bool:
        """Whether a behaviour runs."""
        return behavior in self._running

    @remote("b(s)")
    def isBehaviorLoaded(self, behavior: str) -> bool:
        """Whether a behaviour is loaded, which it is while it runs."""
        return behavior in self._running

    @remote("v(s)")
    def startBehavior(self, behavior: str) -> None:
        """Starts a behaviour and returns at once."""
        self._start(behavior, None)

    @remote("v(s)")
    def runBehavior(self, behavior: str) -> concurrent.futures.Future:
        """Starts a behaviour and waits for its end, which comes at once."""
        done: concurrent.futures.Future = concurrent.futures.Future()
        self._start(behavior, done)
        self.stopBehavior(behavior)
        return done

    @remote("v(s)")
    def stopBehavior(self, behavior: str) -> None:
        """Stops a behaviour."""
        with self._lock:
            if behavior not in self._running:
                raise ServiceError(f"behavior '{shown(behavior)[1:-1]}' is not running")
            waiting = self._running.pop(behavior)
        self.behaviorStopped(behavior)
        if waiting is not None:
            waiting.set_result(None)

    @remote("v()")
    def stopAllBehaviors(self) -> None:
        """Stops every behaviour."""
        for behavior in self.getRunningBehaviors():
            self.stopBehavior(behavior)

    @remote("b(s)")
    def preloadBehavior(self, behavior: str) -> bool:
        """Loads a behaviour; true if it is installed."""
        return behavior in self._packages.behaviors

    @remote("[s]()")
    def getDefaultBehaviors(self) -> list[str]:
        """Lists the behaviours that start with the robot."""
        return []

    def _start(self, behavior: str, waiting: concurrent.futures.Future | None) -> None:
        with self._lock:
            if behavior not in self._packages.behaviors:
                raise ServiceError(f"behavior '{shown(behavior)[1:-1]}' is not installed")
            if behavior in self._running:
                raise ServiceError(f"behavior '{behavior}' is already running")
            self._running[behavior] = waiting
        self.behaviorStarted(behavior)
