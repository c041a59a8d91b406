"""ALFaceDetection: settings are stored; no face is ever recognised.

The simulated cameras show people, but nothing here searches for them: no event is raised and lists stay empty.
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
        """Learns the face in view; none is detected: false."""
        return False

    @remote("b(s)")
    def reLearnFace(self, faceName: str) -> bool:
        """Learns a face again; none is detected: false."""
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
        """Switches recognition on or off."""
        self._recognition = enable

    @remote("b()")
    def isRecognitionEnabled(self) -> bool:
        """Whether recognition is on."""
        return self._recognition

    @remote("v(b)")
    def setTrackingEnabled(self, enable: bool) -> None:
        """Switches tracking on or off."""
        self._tracking = enable

    @remote("b()")
    def isTrackingEnabled(self) -> bool:
        """Whether tracking is on."""
        return self._tracking

    @remote("v(f)")
    def setRecognitionConfidenceThreshold(self, threshold: float) -> None:
        """Sets the confidence from which a face counts as recognised, 0 to 1."""
        self._threshold = within(threshold, 0.0, 1.0, "threshold")

    @remote("f()")
    def getRecognitionConfidenceThreshold(self) -> float:
        """Returns the confidence from which a face counts as recognised."""
        return self._threshold
