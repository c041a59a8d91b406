"""ALWavingDetection: who waves, told by how far a hand moves beside the body.

Pepper has a 3D sensor, so the methods for robots without one are refused. Source: NAOqi 2.8 documentation,
ALWavingDetection.
"""

from __future__ import annotations

from collections import deque

from pepper_sim.naoqi.people.extractor import PeopleExtractor
from pepper_sim.naoqi.people.population import Known, Look, Population
from pepper_sim.naoqi.service import ServiceError, remote
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.services.al_memory import ALMemory

MAX_DISTANCE, MIN_SIZE = 2.5, 0.1
_DISTANCES, _SIZES = (0.5, 3.0), (0.05, 0.3)
WINDOW = 1.5
"""A hand that moved this long ago no longer counts [s]."""
_CENTRE = 0.15
_SIDES = ("Center", "Left", "Right")


class ALWavingDetection(PeopleExtractor):
    """Tells who waves at the robot."""

    name = "ALWavingDetection"
    events = ("WavingDetection/Waving", *(f"WavingDetection/PersonWaving{side}" for side in ("", *_SIDES)))

    def __init__(self, memory: ALMemory, population: Population) -> None:
        super().__init__(memory, population)
        self._distance, self._size = MAX_DISTANCE, MIN_SIZE
        self._hands: dict[int, deque[tuple[float, tuple[float, float, float]]]] = {}
        self._waving: set[int] = set()

    @remote("f()")
    def getMaxDistance(self) -> float:
        """Returns from how far waving is noticed [m]."""
        return self._distance

    @remote("b(f)")
    def setMaxDistance(self, distance: float) -> bool:
        """Sets from how far waving is noticed, 0.5 to 3 m; true if it was."""
        if not _DISTANCES[0] <= distance <= _DISTANCES[1]:
            return False
        self._distance = distance
        return True

    @remote("f()")
    def getMinSize(self) -> float:
        """Returns how far a hand has to move [m]."""
        return self._size

    @remote("b(f)")
    def setMinSize(self, size: float) -> bool:
        """Sets how far a hand has to move, 0.05 to 0.3 m; true if it was."""
        if not _SIZES[0] <= size <= _SIZES[1]:
            return False
        self._size = size
        return True

    @remote("f()")
    def getThreshold(self) -> float:
        """Refused: for robots without a 3D sensor."""
        raise ServiceError("only on robots without a 3D sensor")

    @remote("b(f)")
    def setThreshold(self, threshold: float) -> bool:
        """Refused: for robots without a 3D sensor."""
        raise ServiceError("only on robots without a 3D sensor")

    def update(self, look: Look) -> None:
        hands, waving = {}, set()
        for known in look.visible:
            hand = known.last.hand
            if hand is not None and known.last.distance <= self._distance:
                trail = self._hands.get(known.number, deque())
                trail.append((look.sight.time, hand))
                while trail[0][0] < look.sight.time - WINDOW:
                    trail.popleft()
                hands[known.number] = trail
                if _span(trail) >= self._size:
                    waving.add(known.number)
            self._describe(known, known.number in waving)
        self._hands = hands
        for known in look.visible:
            if known.number in waving and known.number not in self._waving:
                self._announce(known, look)
        self._waving = waving

    def _describe(self, known: Known, waves: bool) -> None:
        side = _side(known)
        self._population.write(known, "IsWaving", waves)
        for name in _SIDES:
            self._population.write(known, f"IsWaving{name}", waves and name == side)

    def _announce(self, known: Known, look: Look) -> None:
        seen = known.last
        clusters = [[list(seen.angles), [0.0, 0.0], seen.distance]]
        self.memory.announce(
            "WavingDetection/Waving",
            [
                split_stamp(look.sight.stamp),
                clusters,
                list(look.sight.camera_in_torso),
                list(look.sight.camera_in_robot),
                0,
            ],
        )
        for side in ("", _side(known)):
            self.memory.announce(f"WavingDetection/PersonWaving{side}", known.number)


def _span(trail: deque[tuple[float, tuple[float, float, float]]]) -> float:
    return max(max(place[axis] for _, place in trail) - min(place[axis] for _, place in trail) for axis in range(3))


def _side(known: Known) -> str:
    aside = known.last.hand[1] if known.last.hand else 0.0
    if abs(aside) < _CENTRE:
        return "Center"
    return "Left" if aside > 0.0 else "Right"
