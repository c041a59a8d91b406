"""Population: who is around the robot, by number, as ALPeoplePerception and the services beside it report them.

One thread looks ten times a second while anybody wants to know; without people in the world, or without subscribers, it
does nothing. Source: NAOqi 2.8 documentation, pages alpeopleperception and alpeopleperception-api.
"""

from __future__ import annotations

import colorsys
import itertools
import logging
import math
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pepper_sim.body.people_sight import PeopleSight, SeenPerson, Sight
from pepper_sim.naoqi.service import ServiceError
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from telepresence.sim.people import Person

log = logging.getLogger(__name__)

PERIOD = 0.1
"""The robot looks for people this often [s]."""
DETECTION_RANGE = 3.5
"""Default of setMaximumDetectionRange [m]; no document gives it, the depth camera is trusted up to 3.5 m."""
TIME_UNSEEN, TIME_HIDDEN = 4.0, 2.0
"""After what time a person is forgotten [s]: who left the picture, and who is not found in it (documented: 2 s)."""
PERSON = "PeoplePerception/Person/"
TOP_CAMERA_ID = 0
_HUES = (
    *((15.0, "Red"), (45.0, "Orange"), (70.0, "Yellow"), (170.0, "Green")),
    *((260.0, "Blue"), (330.0, "Purple"), (361.0, "Red")),
)
"""Upper end of each range of hues [degrees], and its name."""


@dataclass
class Known:
    """One person of the population.

    Args:
        number: The ID of PeopleList.
        since: When the person was first seen, and `seen` when last [s, simulation].
        last: What was seen of the person last.
        tallest: The greatest height so far [m].
    """

    number: int
    since: float
    seen: float
    last: SeenPerson
    tallest: float
    visible: bool = True
    keys: set[str] = field(default_factory=set)


@dataclass(frozen=True)
class Look:
    """What one look told: `sight` itself, and the population after it, those who are visible first by distance."""

    sight: Sight
    visible: tuple[Known, ...]
    known: tuple[Known, ...]


@dataclass(frozen=True)
class _Watcher:
    active: Callable[[], bool]
    tracks: bool
    update: Callable[[Look], None]
    blind: Callable[[], None]


class Population:
    """Who is known, and what looks for them. Any thread may ask."""

    def __init__(self, robot: Pepper, memory: ALMemory) -> None:
        self.sight = PeopleSight(robot)
        self.range = DETECTION_RANGE
        self.time_unseen, self.time_hidden = TIME_UNSEEN, TIME_HIDDEN
        self.last: Look | None = None
        """The last look; None while nobody wants one."""
        self.arrived: list[Callable[[int], Any]] = []
        self.left: list[Callable[[int], Any]] = []
        self.reset_done: list[Callable[[], Any]] = []
        self._memory = memory
        self._robot = robot
        self._numbers = itertools.count(1)
        self._known: dict[int, Known] = {}
        self._lists: dict[str, list[int]] = {}
        self._watchers: list[_Watcher] = []
        self._tracking = False
        self._resets = self._emptied_at = 0
        self._failures: set[tuple[type[Exception], str, int | None]] = set()
        robot.world.on_reset(self._on_reset)
        self._lock = threading.RLock()
        self._closing = threading.Event()
        self._publish_lists()
        self._thread = threading.Thread(target=self._run, name="people", daemon=True)
        self._thread.start()

    def watch(
        self,
        active: Callable[[], bool],
        update: Callable[[Look], None],
        *,
        tracks: bool = True,
        blind: Callable[[], None] = lambda: None,
    ) -> None:
        """Call `update` after every look while `active()`.

        Args:
            tracks: Whether it needs the population kept.
            blind: Called instead when a look failed, or `update` did: what drives after people must not drive on.
        """
        self._watchers.append(_Watcher(active, tracks, update, blind))

    def find(self, number: int) -> Known | None:
        """Return who has this ID; None if nobody has."""
        with self._lock:
            return self._known.get(number)

    def number_of(self, person: Person) -> int | None:
        """Return the ID of somebody, None if the robot does not know of that person."""
        with self._lock:
            return next((known.number for known in self._known.values() if known.last.person is person), None)

    def write(self, known: Known, name: str, value: Any) -> None:
        """Write a key of a person into ALMemory; it is removed with the person."""
        key = f"{PERSON}{known.number}/{name}"
        known.keys.add(key)
        self._memory.store(key, value)

    def forget_all(self) -> None:
        """Empty the population and erase its data."""
        with self._lock:
            for known in list(self._known.values()):
                self._forget(known)
            self._publish_lists()
            self._memory.store("PeoplePerception/PeopleDetected", [])
        for callback in self.reset_done:
            callback()

    def look_now(self) -> Sight:
        """Look once, for a method that does not wait for the next look."""
        return self.sight.look(self.range)

    def close(self) -> None:
        self._closing.set()
        self._thread.join(timeout=2.0)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _on_reset(self) -> None:
        self._resets += 1  # the world's lock is held: all else is the thread's

    def _run(self) -> None:
        while not self._closing.wait(PERIOD):
            try:
                self._update()
            except Exception as error:  # one look that fails must not end all later ones
                self._log_once("people could not be perceived", error)
                for watcher in self._watchers:
                    watcher.blind()

    def _update(self) -> None:
        watchers = [watcher for watcher in self._watchers if watcher.active()]
        tracking = any(watcher.tracks for watcher in watchers)
        if tracking != self._tracking:
            self._tracking = tracking
            self.forget_all()
        resets = self._resets
        if resets != self._emptied_at:  # everybody stands where the scene has them
            self._emptied_at = resets
            self.forget_all()
        if not watchers:
            self.last = None
            return
        sight = self.look_now()
        if resets != self._resets:
            return  # what was seen is of before
        with self._lock:
            if tracking:
                self._update_population(sight)
            known = tuple(self._known.values())
        visible = sorted((one for one in known if one.visible), key=lambda one: one.last.distance)
        self.last = look = Look(sight, tuple(visible), known)
        for watcher in watchers:
            try:
                watcher.update(look)
            except Exception as error:  # one who fails must not keep the look from the others
                self._log_once("somebody could not use what was seen", error)
                watcher.blind()

    def _log_once(self, what: str, error: Exception) -> None:
        """Log a failure with its traceback, but not again at each of the ten looks a second."""
        place = traceback.extract_tb(error.__traceback__)[-1]
        cause = type(error), place.filename, place.lineno
        if cause not in self._failures:
            self._failures.add(cause)
            log.error("%s", what, exc_info=error)

    def _update_population(self, sight: Sight) -> None:
        for known in self._known.values():
            known.visible = False
        by_person = {known.last.person: known for known in self._known.values()}
        for seen in sight.people:
            found = by_person.get(seen.person)
            if found is None:
                found = Known(next(self._numbers), sight.time, sight.time, seen, seen.height)
                self._known[found.number] = found
                self._report(self.arrived, "PeoplePerception/JustArrived", found.number)
            found.last, found.seen, found.visible = seen, sight.time, True
            found.tallest = max(found.tallest, seen.height)
        for known in list(self._known.values()):
            if not known.visible:
                hidden = self.sight.shows(known.last.in_world)
                if sight.time - known.seen > (self.time_hidden if hidden else self.time_unseen):
                    self._forget(known)
                    continue
            self._describe(known, sight)
        self._publish_lists()
        visible = [known for known in self._known.values() if known.visible]
        if visible:
            self._memory.announce(
                "PeoplePerception/PeopleDetected",
                [
                    split_stamp(sight.stamp),
                    [
                        [known.number, known.last.distance, known.last.angles[1], known.last.angles[0]]
                        for known in visible
                    ],
                    list(sight.camera_in_torso),
                    list(sight.camera_in_robot),
                    TOP_CAMERA_ID,
                ],
            )
        elif self._memory.read("PeoplePerception/PeopleDetected"):
            self._memory.store("PeoplePerception/PeopleDetected", [])
        if self._known:
            self._memory.announce("PeoplePerception/PopulationUpdated", [])

    def _describe(self, known: Known, sight: Sight) -> None:
        seen = known.last
        self.write(known, "IsVisible", known.visible)
        self.write(known, "NotSeenSince", int(sight.time - known.seen))
        self.write(known, "PresentSince", int(sight.time - known.since))
        if not known.visible:
            self.write(known, "IsFaceDetected", False)
            return
        hue, saturation, value = _hsv(seen.figure.shirt)
        x, y, z = seen.in_torso
        for name, data in (
            ("AnglesYawPitch", _yaw_pitch(x, y, z + seen.height - seen.in_robot[2])),
            ("Distance", seen.distance),
            ("IsFaceDetected", seen.face is not None),
            ("PositionInRobotFrame", list(seen.in_robot)),
            ("PositionInTorsoFrame", list(seen.in_torso)),
            ("PositionInWorldFrame", list(seen.in_world)),
            ("RealHeight", known.tallest),
            ("ShirtColor", _colour_name(hue, saturation, value)),
            ("ShirtColorHSV", [hue, saturation, value]),
        ):
            self.write(known, name, data)

    def _forget(self, known: Known) -> None:
        del self._known[known.number]
        for key in known.keys:
            _remove(self._memory, key)
        self._report(self.left, "PeoplePerception/JustLeft", known.number)

    def _report(self, callbacks: list[Callable[[int], Any]], event: str, number: int) -> None:
        self._memory.announce(event, number)
        for callback in callbacks:
            callback(number)

    def _publish_lists(self) -> None:
        known = self._known.values()
        for name, numbers in (
            ("PeopleList", [one.number for one in known]),
            ("VisiblePeopleList", [one.number for one in known if one.visible]),
            ("NonVisiblePeopleList", [one.number for one in known if not one.visible]),
        ):
            if self._lists.get(name) == numbers:
                continue
            first = name not in self._lists
            self._lists[name] = numbers
            write = self._memory.store if first else self._memory.announce
            write(f"PeoplePerception/{name}", numbers)


def _remove(memory: ALMemory, key: str) -> None:
    try:
        memory.removeData(key)
    except ServiceError:
        log.debug("%s was removed by a client", key)


def _yaw_pitch(x: float, y: float, z: float) -> list[float]:
    return [math.atan2(y, x), -math.atan2(z, math.hypot(x, y))]


def _hsv(colour: tuple[float, float, float]) -> tuple[float, float, float]:
    hue, saturation, value = colorsys.rgb_to_hsv(*colour)
    return 360.0 * hue, saturation, value


def _colour_name(hue: float, saturation: float, value: float) -> str:
    """Return one of the nine names of colours that are documented for ShirtColor."""
    if value < 0.2:
        return "Black"
    if saturation < 0.15:
        return "White" if value > 0.75 else "Gray"
    return next(name for limit, name in _HUES if hue < limit)
