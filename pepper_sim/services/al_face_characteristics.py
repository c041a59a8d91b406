"""ALFaceCharacteristics: no face is ever analysed."""

from __future__ import annotations

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import remote


class ALFaceCharacteristics(Extractor):
    """Guesses age, gender and expression of a person."""

    name = "ALFaceCharacteristics"
    events = ("FaceCharacteristics/PersonSmiling",)

    @remote("b(i)")
    def analyzeFaceCharacteristics(self, personId: int) -> bool:
        """Analyses a person's face; no person is known: false."""
        return False

    @remote("f()")
    def getSmilingThreshold(self) -> float:
        """Returns the confidence from which a smile counts."""
        return 0.7
