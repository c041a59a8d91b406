"""ALFaceDetection, ALFaceCharacteristics, ALPeoplePerception: settings are kept; no person is ever recognised.

The simulated cameras show people, but nothing here looks for them: events stay silent and lists empty.
"""

from __future__ import annotations

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import remote, within
from pepper_sim.services.al_memory import ALMemory


class ALFaceDetection(Extractor):
    """Detects and recognises faces."""

    name = "ALFaceDetection"
    events = ("FaceDetected",)

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._recognition = self._tracking = True
        self._threshold = 0.4
        memory.store("FaceDetected", [])

    @remote("b(s)")
    def learnFace(self, faceName: str) -> bool:
        """Learns the face in view; none is seen: false."""
        return False

    @remote("b(s)")
    def reLearnFace(self, faceName: str) -> bool:
        """Learns a face again; none is seen: false."""
        return False

    @remote("b(s)")
    def forgetPerson(self, faceName: str) -> bool:
        """Forgets a face; none is known: false."""
        return False

    @remote("b()")
    def clearDatabase(self) -> bool:
        """Forgets all faces."""
        return True

    @remote("[s]()")
    def getLearnedFacesList(self) -> list[str]:
        """Lists the known faces."""
        return []

    @remote("v(b)")
    def setRecognitionEnabled(self, enable: bool) -> None:
        """Switches recognition."""
        self._recognition = enable

    @remote("b()")
    def isRecognitionEnabled(self) -> bool:
        """Whether recognition is on."""
        return self._recognition

    @remote("v(b)")
    def setTrackingEnabled(self, enable: bool) -> None:
        """Switches tracking."""
        self._tracking = enable

    @remote("b()")
    def isTrackingEnabled(self) -> bool:
        """Whether tracking is on."""
        return self._tracking

    @remote("v(f)")
    def setRecognitionConfidenceThreshold(self, threshold: float) -> None:
        """Sets how sure recognition must be, 0 to 1."""
        self._threshold = within(threshold, 0.0, 1.0, "threshold")

    @remote("f()")
    def getRecognitionConfidenceThreshold(self) -> float:
        """Returns how sure recognition must be."""
        return self._threshold


class ALFaceCharacteristics(Extractor):
    """Guesses age, gender and expression of a person."""

    name = "ALFaceCharacteristics"
    events = ("FaceCharacteristics/PersonSmiling",)

    @remote("b(i)")
    def analyzeFaceCharacteristics(self, personId: int) -> bool:
        """Analyses a person's face; the person is not known: false."""
        return False

    @remote("f()")
    def getSmilingThreshold(self) -> float:
        """Returns how sure a smile must be."""
        return 0.7


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
        """Sets how far people may be [m]."""
        self._settings["MaximumDetectionRange"] = within(range, 0.0, 20.0, "range")

    @remote("f()")
    def getMaximumDetectionRange(self) -> float:
        """Returns how far people may be [m]."""
        return self._settings["MaximumDetectionRange"]

    @remote("v(f)")
    def setTimeBeforePersonDisappears(self, seconds: float) -> None:
        """Sets when a person out of sight is forgotten [s]."""
        self._settings["TimeBeforePersonDisappears"] = within(seconds, 0.0, 3600.0, "seconds")

    @remote("f()")
    def getTimeBeforePersonDisappears(self) -> float:
        """Returns when a person out of sight is forgotten [s]."""
        return self._settings["TimeBeforePersonDisappears"]

    @remote("v(b)")
    def setFastModeEnabled(self, enable: bool) -> None:
        """Switches detection by face only."""
        self._switches["FastMode"] = enable

    @remote("b()")
    def isFastModeEnabled(self) -> bool:
        """Whether detection is by face only."""
        return self._switches["FastMode"]

    @remote("b()")
    def isFaceDetectionEnabled(self) -> bool:
        """Whether faces are looked for: no."""
        return False
