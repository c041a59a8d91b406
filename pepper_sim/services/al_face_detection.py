"""ALFaceDetection: settings are kept; no face is ever recognised.

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
