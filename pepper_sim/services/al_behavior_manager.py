"""ALBehaviorManager: installed and running behaviours. Source: NAOqi 2.8 documentation, ALBehaviorManager.

The animations of Pepper's library are behaviours of the package "animations". A behaviour of a package that somebody
installed is carried out when its folder holds Choregraphe's behavior.xar, or when it is a .qianim file; one without a
file (those that are listed by default) is listed as running until it is stopped, and `runBehavior` ends at once.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pepper_sim.animations import library
from pepper_sim.animations.behavior import FILE, read_behavior
from pepper_sim.animations.behavior_process import BehaviorProcess
from pepper_sim.animations.flow import Flow
from pepper_sim.animations.generator import playable
from pepper_sim.animations.stage import JointStage
from pepper_sim.animations.timeline import read_qianim
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.installed_packages import UNTRUSTED, InstalledPackages
from pepper_sim.naoqi.motion.joints import Knots, MotionJoints
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown
from pepper_sim.naoqi.tasks import Alarm, Workers
from pepper_sim.services.al_memory import ALMemory
from telepresence.naoqi.signals import Signal

DEFAULT_NATURE = "interactive"
"""Choregraphe's default for a behaviour whose manifest names none."""
Start = Callable[[concurrent.futures.Future], Callable[[], Any]]
"""Starts a behaviour: gets the future that is done at its end, returns what stops it."""
_EVENTS = ("BehaviorAdded", "BehaviorRemoved", "BehaviorUpdated", "BehaviorsAdded")


class ALBehaviorManager(Module):
    """Starts and stops installed behaviours."""

    name = "ALBehaviorManager"

    def __init__(
        self,
        packages: InstalledPackages,
        memory: ALMemory,
        joints: MotionJoints,
        clients: ClientServices,
        workers: Workers,
        alarm: Alarm,
    ) -> None:
        self._packages = packages
        self._memory = memory
        self._joints = joints
        self._clients = clients
        self._workers = workers
        self._alarm = alarm
        self._lock = threading.Lock()
        self._running: dict[str, concurrent.futures.Future] = {}
        self._defaults: list[str] = []
        self.behaviorStarted = Signal("(s)")
        self.behaviorStopped = Signal("(s)")
        self.behaviorLoaded = Signal("(s)")
        self.behaviorFailed = Signal("(sss)")
        self.behaviorsAdded = Signal("([s])")
        self.behaviorsRemoved = Signal("([s])")
        memory.declare((*(f"ALBehaviorManager/{event}" for event in _EVENTS), "BehaviorsRun"), self.name)
        memory.store("BehaviorsRun", [])
        packages.on_changed(self._compare)

    def close(self) -> None:
        self.stopAllBehaviors()

    # --- installed ---------------------------------------------------------------------------------------------------

    @remote("[s]()")
    def getInstalledBehaviors(self) -> list[str]:
        """Lists the installed behaviours."""
        return [*self._packages.behaviors, *library.paths()]

    @remote("[s]()")
    def getBehaviorNames(self) -> list[str]:
        """Lists the installed behaviours (older name)."""
        return self.getInstalledBehaviors()

    @remote("[s]()")
    def getUserBehaviorNames(self) -> list[str]:
        """Lists the behaviours that were installed by a user (older method)."""
        return list(self._packages.behaviors)

    @remote("[s]()")
    def getSystemBehaviorNames(self) -> list[str]:
        """Lists the behaviours that the robot came with (older method)."""
        return list(library.paths())

    @remote("b(s)")
    def isBehaviorInstalled(self, name: str) -> bool:
        """Whether a behaviour is installed."""
        return self.installed(name)

    @remote("b(s)")
    def isBehaviorPresent(self, prefixedBehavior: str) -> bool:
        """Whether a behaviour is installed (older name)."""
        return self.installed(prefixedBehavior)

    @remote("s(s)")
    def resolveBehaviorName(self, behaviorName: str) -> str:
        """Returns the "package/path" of a behaviour, which may be named by its path alone; "" if there is none."""
        if self.installed(behaviorName):
            return behaviorName
        found = [name for name in self.getInstalledBehaviors() if name.partition("/")[2] == behaviorName]
        if len(found) > 1:
            raise ServiceError(f"several behaviors have the name '{shown(behaviorName)[1:-1]}': {', '.join(found[:5])}")
        return found[0] if found else ""

    @remote("s(s)")
    def getBehaviorNature(self, behavior: str) -> str:
        """Returns the nature of a behaviour: what its manifest says, "interactive" if it says nothing."""
        self._require(behavior)
        return self._packages.nature(behavior) or ("" if library.has(behavior) else DEFAULT_NATURE)

    # --- tags --------------------------------------------------------------------------------------------------------

    @remote("[s]()")
    def getTagList(self) -> list[str]:
        """Lists the tags of the installed behaviours."""
        return sorted(
            {*library.tags(), *(tag for name in self._packages.behaviors for tag in self._packages.tags(name))}
        )

    @remote("[s](s)")
    def getBehaviorTags(self, behavior: str) -> list[str]:
        """Lists the tags of a behaviour, or of all behaviours below a folder."""
        found = [name for name in self.getInstalledBehaviors() if name == behavior or name.startswith(f"{behavior}/")]
        if not found:
            raise ServiceError(f"behavior '{shown(behavior)[1:-1]}' is not installed")
        return sorted({tag for name in found for tag in self.tags_of(name)})

    @remote("[s](s)")
    def getBehaviorsByTag(self, tag: str) -> list[str]:
        """Lists the behaviours that have a tag."""
        return [name for name in self.getInstalledBehaviors() if tag in self.tags_of(name)]

    # --- running -----------------------------------------------------------------------------------------------------

    @remote("[s]()")
    def getRunningBehaviors(self) -> list[str]:
        """Lists the running behaviours."""
        with self._lock:
            return list(self._running)

    @remote("[s]()")
    def getLoadedBehaviors(self) -> list[str]:
        """Lists the loaded behaviours: those that run."""
        return self.getRunningBehaviors()

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
        self.play(behavior)

    @remote("v(s)")
    def runBehavior(self, behavior: str) -> concurrent.futures.Future:
        """Starts a behaviour and waits for its end. Cancelling the call stops it."""
        run = self.play(behavior)
        if not self._has_content(behavior):
            self.stopBehavior(behavior)
        return run

    @remote("v(s)")
    def stopBehavior(self, behavior: str) -> None:
        """Stops a behaviour."""
        with self._lock:
            run = self._running.get(behavior)
        if run is None:
            raise ServiceError(f"behavior '{shown(behavior)[1:-1]}' is not running")
        _end(run)

    @remote("v()")
    def stopAllBehaviors(self) -> None:
        """Stops every behaviour."""
        with self._lock:
            runs = list(self._running.values())
        for run in runs:
            _end(run)

    @remote("b(s)")
    def preloadBehavior(self, behavior: str) -> bool:
        """Loads a behaviour; true if it is installed."""
        if self.installed(behavior):
            self.behaviorLoaded(behavior)
        return self.installed(behavior)

    # --- defaults ----------------------------------------------------------------------------------------------------

    @remote("[s]()")
    def getDefaultBehaviors(self) -> list[str]:
        """Lists the behaviours that playDefaultProject starts."""
        return list(self._defaults)

    @remote("v(s)")
    def addDefaultBehavior(self, prefixedBehavior: str) -> None:
        """Makes a behaviour one of those that playDefaultProject starts."""
        self._require(prefixedBehavior)
        if prefixedBehavior not in self._defaults:
            self._defaults.append(prefixedBehavior)

    @remote("v(s)")
    def removeDefaultBehavior(self, name: str) -> None:
        """Takes a behaviour out of those that playDefaultProject starts."""
        if name not in self._defaults:
            raise ServiceError(f"behavior '{shown(name)[1:-1]}' is no default behavior")
        self._defaults.remove(name)

    @remote("v()")
    def playDefaultProject(self) -> None:
        """Starts the default behaviours that do not run yet."""
        for behavior in self._defaults:
            if not self.isBehaviorRunning(behavior):
                self.startBehavior(behavior)

    # --- for the other services --------------------------------------------------------------------------------------

    def installed(self, behavior: str) -> bool:
        """Whether a behaviour is installed."""
        return library.has(behavior) or behavior in self._packages.behaviors

    def tags_of(self, behavior: str) -> tuple[str, ...]:
        """Return the tags of a behaviour."""
        return library.tags_of(behavior) or self._packages.tags(behavior)

    def play(self, behavior: str) -> concurrent.futures.Future:
        """Start a behaviour; the future is done when it is over, and cancelling it stops the behaviour.

        Raises: ServiceError: It is not installed, runs already, or its file cannot be read.
        """
        self._require(behavior)
        start = self._prepared(behavior)
        run: concurrent.futures.Future = concurrent.futures.Future()
        with self._lock:
            if behavior in self._running:
                raise ServiceError(f"behavior '{behavior}' is already running")
            self._running[behavior] = run
        self.behaviorLoaded(behavior)
        self.behaviorStarted(behavior)
        self._announce_running()
        try:
            stop = start(run)
        except Exception:
            self._ended(behavior, lambda: None)
            raise
        run.add_done_callback(lambda _: self._ended(behavior, stop))
        return run

    # --- inside ------------------------------------------------------------------------------------------------------

    def _require(self, behavior: str) -> None:
        if not self.installed(behavior):
            raise ServiceError(f"behavior '{shown(behavior)[1:-1]}' is not installed")

    def _has_content(self, behavior: str) -> bool:
        return library.has(behavior) or self._packages.file_of(behavior) is not None

    def _prepared(self, behavior: str) -> Start:
        """Read a behaviour; return what starts it and returns what stops it."""
        if library.has(behavior):
            curves = library.curves(behavior)
            return lambda run: self._move(run, curves, lambda start: playable(curves, start, start))
        file = self._packages.file_of(behavior)
        if file is None:
            return lambda run: lambda: None
        if file.name != FILE:
            timeline = read_qianim(file)
            return lambda run: self._move(run, timeline.curves, timeline.knots)
        root = read_behavior(file)
        if any(box.script for box in root.all()):
            if not self._packages.may_run(behavior):
                raise ServiceError(f"behavior '{behavior}' holds scripts, which do not run: {UNTRUSTED}")
            return lambda run: self._run_process(run, behavior, file)
        return lambda run: self._run_flow(run, behavior, Flow(root, JointStage(self._joints, self._alarm)))

    def _move(
        self, run: concurrent.futures.Future, joints: Iterable[str], knots: Callable[[Mapping[str, float]], Knots]
    ) -> Callable[[], Any]:
        motion = self._joints.plan("animation", joints, knots)
        motion.add_done_callback(lambda _: _end(run))
        return motion.cancel

    def _run_flow(self, run: concurrent.futures.Future, behavior: str, flow: Flow) -> Callable[[], Any]:
        done = self._workers.run(flow.run)
        done.add_done_callback(lambda done: self._flowed(run, behavior, done))
        return flow.stop

    def _flowed(self, run: concurrent.futures.Future, behavior: str, done: concurrent.futures.Future) -> None:
        if not done.cancelled() and done.exception() is not None:
            self.behaviorFailed(behavior, "root", str(done.exception()))
        _end(run)

    def _run_process(self, run: concurrent.futures.Future, behavior: str, file: Path) -> Callable[[], Any]:
        def ended(box: str, error: str) -> None:
            if error:
                self.behaviorFailed(behavior, box, error)
            _end(run)

        return BehaviorProcess(file, behavior, self._clients.url, ended).stop

    def _ended(self, behavior: str, stop: Callable[[], Any]) -> None:
        stop()
        with self._lock:
            self._running.pop(behavior, None)
        self.behaviorStopped(behavior)
        self._announce_running()

    def _announce_running(self) -> None:
        self._memory.announce("BehaviorsRun", self.getRunningBehaviors())

    def _compare(self, before: Sequence[str], after: Sequence[str]) -> None:
        """Report what a package that came or went has changed."""
        removed = [name for name in before if name not in after]
        added = [name for name in after if name not in before]
        for name in removed:
            self._memory.announce("ALBehaviorManager/BehaviorRemoved", name)
        for name in added:
            self._memory.announce("ALBehaviorManager/BehaviorAdded", name)
        if removed:
            self.behaviorsRemoved(removed)
        if added:
            self._memory.announce("ALBehaviorManager/BehaviorsAdded", added)
            self.behaviorsAdded(added)
        if not removed and not added:
            for name in after:
                self._memory.announce("ALBehaviorManager/BehaviorUpdated", name)


def _end(run: concurrent.futures.Future) -> None:
    """Complete a run, unless it was stopped in the meantime."""
    with contextlib.suppress(concurrent.futures.InvalidStateError):
        run.set_result(None)
