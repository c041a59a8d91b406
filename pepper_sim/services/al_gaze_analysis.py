"""ALGazeAnalysis: who looks at the robot. The head says where a person looks; eyes here look straight ahead.

Source: NAOqi 2.8 documentation, ALGazeAnalysis: the score is compared with 1 - tolerance.
"""

from __future__ import annotations

import math

from pepper_sim.naoqi.people.extractor import PeopleExtractor
from pepper_sim.naoqi.people.population import Look, Population
from pepper_sim.naoqi.service import remote, within
from pepper_sim.services.al_memory import ALMemory

TOLERANCE = 0.5
NOT_LOOKING = math.radians(50.0)
"""Angle between face and camera from which on the score is 0 [rad]; no document gives it."""


class ALGazeAnalysis(PeopleExtractor):
    """Tells where people look."""

    name = "ALGazeAnalysis"
    events = (
        "GazeAnalysis/PersonStartsLookingAtRobot",
        "GazeAnalysis/PersonStopsLookingAtRobot",
        "GazeAnalysis/PeopleLookingAtRobot",
    )

    def __init__(self, memory: ALMemory, population: Population) -> None:
        super().__init__(memory, population)
        self._tolerance = TOLERANCE
        self._looking: list[int] = []
        memory.store("GazeAnalysis/PeopleLookingAtRobot", [])

    @remote("f()")
    def getTolerance(self) -> float:
        """Returns the tolerance, 0 to 1."""
        return self._tolerance

    @remote("v(f)")
    def setTolerance(self, tolerance: float) -> None:
        """Sets the tolerance: 0 counts only straight looks, 1 all."""
        self._tolerance = within(tolerance, 0.0, 1.0, "tolerance")

    @remote("b()")
    def isFaceAnalysisEnabled(self) -> bool:
        """Always false: there is only one mode (deprecated)."""
        return False

    @remote("v(b)")
    def setFaceAnalysisEnabled(self, status: bool) -> None:
        """Has no effect: there is only one mode (deprecated)."""

    def update(self, look: Look) -> None:
        looking = []
        for known in look.visible:
            face = known.last.face
            score = 0.0
            if face is not None:
                angle = math.hypot(face.turn[0], face.turn[1])
                score = max(0.0, 1.0 - angle / NOT_LOOKING)
                self._population.write(known, "HeadAngles", list(face.turn))
                self._population.write(known, "GazeDirection", [0.0, 0.0])
                self._population.write(known, "EyeOpeningDegree", [1.0, 1.0])
            at_robot = face is not None and score > 1.0 - self._tolerance
            self._population.write(known, "LookingAtRobotScore", score)
            self._population.write(known, "IsLookingAtRobot", at_robot)
            if at_robot:
                looking.append(known.number)
        before, self._looking = self._looking, looking
        for number in looking:
            if number not in before:
                self.memory.announce("GazeAnalysis/PersonStartsLookingAtRobot", number)
        for number in before:
            if number not in looking:
                self.memory.announce("GazeAnalysis/PersonStopsLookingAtRobot", number)
        if looking != before:
            self.memory.announce("GazeAnalysis/PeopleLookingAtRobot", looking)
