"""Targets of ALTracker: where a face, a person, a ball, a mark, a noise or the object of an event is.

People and faces come from the robot's own eyes; the others from what their extractor, or any client, last wrote into
ALMemory: a value that is malformed or not finite is no target, or the base would drive to it at full speed. Source:
NAOqi 2.8 documentation, pages trackers and altracker-api; the values are those of the extractors' pages.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pepper_sim.naoqi.people.faces import MAX_TRACKED_TURN, found
from pepper_sim.naoqi.people.population import Look, Population
from pepper_sim.naoqi.service import ServiceError, finite, shown
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

EXTRACTORS: Mapping[str, str] = {
    "Face": "ALFaceDetection",
    "LandMark": "ALLandMarkDetection",
    "LandMarks": "ALLandMarkDetection",
    "People": "ALPeoplePerception",
    "RedBall": "ALRedBallDetection",
    "Sound": "ALSoundLocalization",
}
"""Name of a target -> the extractor that finds it."""
TARGETS = tuple(EXTRACTORS)
FRESH = 1.0
"""What an extractor wrote longer ago than this is no target any more [s]."""
_FACE_PICTURE = 640
Place = tuple[float, float, float]


@dataclass(frozen=True)
class _Extracted:
    """Where the value of an extractor's key says that its target is."""

    key: str
    place: Callable[[Any, Any], Sequence[tuple[float, float, float]]]
    """Value and the target's parameters -> yaw, pitch [rad] and distance [m] from the camera."""


class Targets:
    """Finds targets for one robot. Places are in the odometry frame [m]."""

    def __init__(self, robot: Pepper, memory: ALMemory, population: Population) -> None:
        self._robot = robot
        self._memory = memory
        self._population = population

    def locate(self, name: str, parameters: Any, look: Look) -> Place | None:
        """Return where the target called `name` is; None if it is not seen. Any other name is that of an event."""
        if name == "People":
            wanted = people_ids(parameters)
            return next((k.last.in_world for k in look.visible if not wanted or k.number in wanted), None)
        if name == "Face":
            faces = (seen for seen in look.sight.people if found(seen, _FACE_PICTURE, MAX_TRACKED_TURN))
            return next((seen.in_world for seen in faces), None)
        if name in _EXTRACTED:
            places = self._places(_EXTRACTED[name], parameters)
            return tuple(np.mean(places, axis=0).tolist()) if places else None  # type: ignore[return-value]
        return self._of_event(name)

    def robot_among_marks(self, parameters: Any, coordinates: Sequence[Sequence[float]]) -> list[float]:
        """Return the robot's pose [x, y, z, wx, wy, wz] where two marks have these coordinates; [] if one is unseen."""
        with self._robot.world.locked():
            base = np.linalg.inv(self._robot.link_pose("base_footprint"))
        places = [(base @ (*place, 1.0))[:3] for place in self._places(_EXTRACTED["LandMarks"], parameters)]
        if len(places) < 2 or len(coordinates) < 2:
            return []
        seen, known = places[1] - places[0], np.subtract(coordinates[1], coordinates[0])
        heading = math.atan2(known[1], known[0]) - math.atan2(seen[1], seen[0])
        c, s = math.cos(heading), math.sin(heading)
        x, y, z = places[0].tolist()
        x0, y0, z0 = coordinates[0]
        return [x0 - (c * x - s * y), y0 - (s * x + c * y), z0 - z, 0.0, 0.0, math.atan2(s, c)]

    def _places(self, kind: _Extracted, parameters: Any) -> list[Place]:
        value = self._memory.read(kind.key)
        try:
            if len(value) < 4 or not _fresh(value[0]):
                return []
            camera = [float(number) for number in value[3]]
            places = [[*seen_from(camera, *sighting), 1.0] for sighting in kind.place(value, parameters)]
            if not np.isfinite(places).all():
                return []
        except (TypeError, ValueError, LookupError, OverflowError):
            return []  # not what an extractor writes, or nothing yet
        with self._robot.world.locked():
            base = self._robot.link_pose("base_footprint")
        return [_place(base @ place) for place in places]

    def _of_event(self, event: str) -> Place | None:
        """Read [Position6D in the world, stamp, effector] or [Position6D in torso, in robot, stamp, effector]."""
        value = self._memory.read(event)
        try:
            in_world = len(value[1]) == 2
            position, stamp = value[0 if in_world else 1], value[1 if in_world else 2]
            place = np.array([*position[:3], 1.0], float)
            if not (_fresh(stamp) and np.isfinite(place).all()):
                return None
        except (TypeError, ValueError, LookupError, OverflowError):
            return None  # another kind of value, or none yet
        if not in_world:
            with self._robot.world.locked():
                place = self._robot.link_pose("base_footprint") @ place
        return _place(place)


def check_parameters(name: str, parameters: Any) -> Any:
    """Return a target's parameters if they are as documented.

    Raises: ServiceError: They are not; the text says what the target takes.
    """
    if name in ("Face", "RedBall"):
        if finite(parameters, f"Param of {name}") <= 0.0:
            raise ServiceError(f"Param of {name} must be a size in metres, got {shown(parameters)}")
    elif name == "People":
        people_ids(parameters)
    elif not isinstance(parameters, list | tuple) or not parameters:
        raise ServiceError(f"Param of {name} must be a list, got {shown(parameters)}")
    return parameters


def people_ids(parameters: Any) -> list[int]:
    """Return the IDs of a People target, [] for anybody.

    Raises: ServiceError: There is something else among them.
    """
    ids = parameters if isinstance(parameters, list | tuple) else [parameters] if parameters else []
    return [int(finite(number, "Param of People")) for number in ids]


def seen_from(camera: Sequence[float], yaw: float, pitch: float, distance: float) -> Place:
    """Return the place in FRAME_ROBOT [m] of what a camera of that Position6D sees at angles and a distance."""
    x, y, z, roll, tilt, heading = camera
    ahead = (math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), -math.sin(pitch))
    rolled = (
        ahead[0],
        ahead[1] * math.cos(roll) - ahead[2] * math.sin(roll),
        ahead[1] * math.sin(roll) + ahead[2] * math.cos(roll),
    )
    level = (
        rolled[0] * math.cos(tilt) + rolled[2] * math.sin(tilt),
        rolled[1],
        rolled[2] * math.cos(tilt) - rolled[0] * math.sin(tilt),
    )
    return (
        x + distance * (level[0] * math.cos(heading) - level[1] * math.sin(heading)),
        y + distance * (level[0] * math.sin(heading) + level[1] * math.cos(heading)),
        z + distance * level[2],
    )


def _place(point: np.ndarray) -> Place:
    return float(point[0]), float(point[1]), float(point[2])


def _fresh(stamp: Any) -> bool:
    return 0.0 <= time.time() - (stamp[0] + 1e-6 * stamp[1]) + 0.1 < FRESH


def _ball(value: Any, diameter: Any) -> list[tuple[float, float, float]]:
    x, y, width = value[1][:3]
    return [(x, y, _distance(float(diameter), width))]


def _mark(value: Any, parameters: Any) -> list[tuple[float, float, float]]:
    size, ids = (parameters[0], parameters[1]) if len(parameters) > 1 else (parameters[0], [])
    wanted = ids if isinstance(ids, list | tuple) else [ids]
    return [
        (x, y, _distance(size, width))
        for (_, x, y, width, *_), (number, *_) in value[1]
        if not wanted or number in wanted
    ][:1]


def _marks(value: Any, parameters: Any) -> list[tuple[float, float, float]]:
    each = [_mark(value, one) for one in parameters]
    return [place for found_marks in each for place in found_marks] if all(each) else []


def _sound(value: Any, parameters: Any) -> list[tuple[float, float, float]]:
    azimuth, elevation, confidence = value[1][:3]
    distance, least = (*parameters, 0.0)[:2]
    return [(azimuth, -elevation, float(distance))] if confidence >= least else []


def _distance(size: float, angle: float) -> float:
    return float(size) / (2.0 * math.tan(0.5 * max(angle, 1e-3)))


_EXTRACTED = {
    "RedBall": _Extracted("redBallDetected", _ball),
    "LandMark": _Extracted("LandmarkDetected", _mark),
    "LandMarks": _Extracted("LandmarkDetected", _marks),
    "Sound": _Extracted("ALSoundLocalization/SoundLocated", _sound),
}
