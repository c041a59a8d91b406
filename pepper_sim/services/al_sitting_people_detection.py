"""ALSittingPeopleDetection: who sits, told by the height of the head. Source: NAOqi 2.8 documentation."""

from __future__ import annotations

from pepper_sim.naoqi.people.extractor import PeopleExtractor
from pepper_sim.naoqi.people.population import Look, Population
from pepper_sim.naoqi.service import remote, within
from pepper_sim.services.al_memory import ALMemory

THRESHOLD = 1.5
_STANDING, _SITTING, _UNKNOWN = 0, 1, 2


class ALSittingPeopleDetection(PeopleExtractor):
    """Tells who sits."""

    name = "ALSittingPeopleDetection"
    events = ("SittingPeopleDetection/PersonSittingDown", "SittingPeopleDetection/PersonStandingUp")

    def __init__(self, memory: ALMemory, population: Population) -> None:
        super().__init__(memory, population)
        self._threshold = THRESHOLD
        self._postures: dict[int, int] = {}

    @remote("f()")
    def getSittingThreshold(self) -> float:
        """Returns the height of a head below which its owner sits [m]."""
        return self._threshold

    @remote("v(f)")
    def setSittingThreshold(self, threshold: float) -> None:
        """Sets the height of a head below which its owner sits [m]."""
        self._threshold = within(threshold, 0.0, 3.0, "threshold")

    def update(self, look: Look) -> None:
        before, self._postures = self._postures, {}
        for known in look.known:
            number = known.number
            posture = before.get(number, _UNKNOWN)
            if known.visible:
                posture = _SITTING if known.last.height < self._threshold else _STANDING
            self._postures[number] = posture
            self._population.write(known, "IsSitting", posture)
            if (before.get(number), posture) == (_STANDING, _SITTING):
                self.memory.announce("SittingPeopleDetection/PersonSittingDown", number)
            elif (before.get(number), posture) == (_SITTING, _STANDING):
                self.memory.announce("SittingPeopleDetection/PersonStandingUp", number)
