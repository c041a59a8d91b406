"""ALPeoplePerception: keeps track of the people around the robot.

Whom the robot sees, and how far, is `pepper_sim.body.people_sight`'s; the list of those it knows of is
`pepper_sim.naoqi.people.population`'s. Source: NAOqi 2.8 documentation, ALPeoplePerception.
"""

from __future__ import annotations

from pepper_sim.naoqi.people.extractor import PeopleExtractor
from pepper_sim.naoqi.people.population import Population
from pepper_sim.naoqi.service import remote, within
from pepper_sim.services.al_memory import ALMemory
from telepresence.naoqi.signals import Signal

_LONGEST = 3600.0
_FARTHEST = 20.0


class ALPeoplePerception(PeopleExtractor):
    """Keeps track of the people around."""

    name = "ALPeoplePerception"
    events = tuple(
        f"PeoplePerception/{event}"
        for event in (
            "JustArrived",
            "JustLeft",
            "PeopleDetected",
            "PeopleList",
            "VisiblePeopleList",
            "NonVisiblePeopleList",
            "PopulationUpdated",
            "MaximumDetectionRangeUpdated",
        )
    )

    def __init__(self, memory: ALMemory, population: Population) -> None:
        super().__init__(memory, population)
        self._fast = self._graphical = False
        self._movement = True
        self.justArrived = Signal("(i)")
        self.justLeft = Signal("(i)")
        self.populationReset = Signal("()")
        self.maximumDetectionRangeChanged = Signal("(f)")
        population.arrived.append(self.justArrived)
        population.left.append(self.justLeft)
        population.reset_done.append(self.populationReset)

    @remote("v()")
    def resetPopulation(self) -> None:
        """Forgets everybody and erases their data from ALMemory."""
        self._population.forget_all()

    @remote("v(f)")
    def setMaximumDetectionRange(self, range: float) -> None:
        """Sets the range of detection [m]."""
        self._population.range = within(range, 0.0, _FARTHEST, "range")
        self.memory.announce("PeoplePerception/MaximumDetectionRangeUpdated", range)
        self.maximumDetectionRangeChanged(range)

    @remote("f()")
    def getMaximumDetectionRange(self) -> float:
        """Returns the range of detection [m]."""
        return self._population.range

    @remote("v(f)")
    def setTimeBeforePersonDisappears(self, seconds: float) -> None:
        """Sets after what time a person is forgotten of whom the robot looks away [s]."""
        self._population.time_unseen = within(seconds, 0.0, _LONGEST, "seconds")

    @remote("f()")
    def getTimeBeforePersonDisappears(self) -> float:
        """Returns after what time a person is forgotten of whom the robot looks away [s]."""
        return self._population.time_unseen

    @remote("v(f)")
    def setTimeBeforeVisiblePersonDisappears(self, seconds: float) -> None:
        """Sets after what time a person is forgotten who is no longer found in the picture [s]."""
        self._population.time_hidden = within(seconds, 0.0, _LONGEST, "seconds")

    @remote("f()")
    def getTimeBeforeVisiblePersonDisappears(self) -> float:
        """Returns after what time a person is forgotten who is no longer found in the picture [s]."""
        return self._population.time_hidden

    @remote("v(b)")
    def setFastModeEnabled(self, enable: bool) -> None:
        """Switches the optional detections off, or on again. Only the detection of movements is one."""
        self._fast = enable
        self._movement = not enable

    @remote("b()")
    def isFastModeEnabled(self) -> bool:
        """Whether the optional detections are off."""
        return self._fast

    @remote("v(b)")
    def setMovementDetectionEnabled(self, enable: bool) -> None:
        """Lets movements help to find people, or not. Stored only: nobody here is found by movements."""
        self._movement = enable

    @remote("b()")
    def isMovementDetectionEnabled(self) -> bool:
        """Whether movements help to find people."""
        return self._movement

    @remote("v(b)")
    def setGraphicalDisplayEnabled(self, enable: bool) -> None:
        """Switches data for Choregraphe's view of the robot on or off. Stored only."""
        self._graphical = enable

    @remote("b()")
    def isGraphicalDisplayEnabled(self) -> bool:
        """Whether data for Choregraphe's view is pushed."""
        return self._graphical

    @remote("b()")
    def isFaceDetectionEnabled(self) -> bool:
        """Whether faces help to find people: always."""
        return True

    @remote("v(b)")
    def setFaceDetectionEnabled(self, enable: bool) -> None:
        """Has no effect: faces always help (deprecated)."""
