"""ALPeoplePerception: settings are stored; no person is ever detected.

The simulated cameras show people, but nothing here searches for them: no event is raised and lists stay empty.
"""

from __future__ import annotations

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import remote, within
from pepper_sim.services.al_memory import ALMemory


class ALPeoplePerception(Extractor):
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
            "PopulationUpdated",
        )
    )

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._settings: dict[str, float] = {"MaximumDetectionRange": 3.5, "TimeBeforePersonDisappears": 2.0}
        self._switches: dict[str, bool] = dict.fromkeys(("FastMode", "GraphicalDisplay", "MovementDetection"), False)
        memory.store("PeoplePerception/PeopleList", [])
        memory.store("PeoplePerception/VisiblePeopleList", [])

    @remote("v()")
    def resetPopulation(self) -> None:
        """Forgets everybody."""

    @remote("v(f)")
    def setMaximumDetectionRange(self, range: float) -> None:
        """Sets the range of detection [m]."""
        self._settings["MaximumDetectionRange"] = within(range, 0.0, 20.0, "range")

    @remote("f()")
    def getMaximumDetectionRange(self) -> float:
        """Returns the range of detection [m]."""
        return self._settings["MaximumDetectionRange"]

    @remote("v(f)")
    def setTimeBeforePersonDisappears(self, seconds: float) -> None:
        """Sets after what time a person out of sight is forgotten [s]."""
        self._settings["TimeBeforePersonDisappears"] = within(seconds, 0.0, 3600.0, "seconds")

    @remote("f()")
    def getTimeBeforePersonDisappears(self) -> float:
        """Returns after what time a person out of sight is forgotten [s]."""
        return self._settings["TimeBeforePersonDisappears"]

    @remote("v(b)")
    def setFastModeEnabled(self, enable: bool) -> None:
        """Switches detection by face only on or off."""
        self._switches["FastMode"] = enable

    @remote("b()")
    def isFastModeEnabled(self) -> bool:
        """Whether detection is by face only."""
        return self._switches["FastMode"]

    @remote("b()")
    def isFaceDetectionEnabled(self) -> bool:
        """Whether faces are detected: no."""
        return False
