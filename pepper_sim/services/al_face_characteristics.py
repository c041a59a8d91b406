"""ALFaceCharacteristics: age, gender, smile and expression of faces, as a passer-by would guess them from the picture.

Only a face that the robot sees is analysed, and the less sure the farther and the more turned away it is. Source: NAOqi
2.8 documentation, ALFaceCharacteristics.
"""

from __future__ import annotations

import math

from pepper_sim.body.people_sight import SeenFace, SeenPerson
from pepper_sim.naoqi.people.extractor import PeopleExtractor
from pepper_sim.naoqi.people.population import Known, Look, Population
from pepper_sim.naoqi.service import remote, within
from pepper_sim.services.al_memory import ALMemory

SMILING_THRESHOLD = 0.7
OLDEST = 75
"""Ages are limited to this [years]."""
PIXELS = 320
"""Width of the picture that is analysed [px]; its focal length is that of the top camera."""
_FOCAL = PIXELS / 2 / math.tan(math.radians(28.5))
_SHARP = 40.0
"""A face of this width is analysed best [px]."""
_TURNED = math.radians(45.0)


class ALFaceCharacteristics(PeopleExtractor):
    """Guesses age, gender and expression of people."""

    name = "ALFaceCharacteristics"
    events = ("FaceCharacteristics/PersonSmiling",)

    def __init__(self, memory: ALMemory, population: Population) -> None:
        super().__init__(memory, population)
        self._threshold = SMILING_THRESHOLD

    @remote("b(i)")
    def analyzeFaceCharacteristics(self, personId: int) -> bool:
        """Analyses a person's face now; false if the person is unknown or the face is not seen."""
        known = self._population.find(personId)
        return known is not None and known.visible and self._analyse(known)

    @remote("f()")
    def getSmilingThreshold(self) -> float:
        """Returns how broad a smile has to be, 0 to 1."""
        return self._threshold

    @remote("v(f)")
    def setSmilingThreshold(self, threshold: float) -> None:
        """Sets how broad a smile has to be, 0 to 1."""
        self._threshold = within(threshold, 0.0, 1.0, "threshold")

    def update(self, look: Look) -> None:
        for known in look.visible:
            if self._analyse(known) and known.last.figure.smile > self._threshold:
                self.memory.announce("FaceCharacteristics/PersonSmiling", known.number)

    def _analyse(self, known: Known) -> bool:
        seen = known.last
        if seen.face is None:
            self._population.write(known, "ExpressionProperties", [0.0] * 5)
            return False
        sure = confidence(seen.face)
        figure = seen.figure
        neutral = 1.0 - figure.smile
        for name, value in (
            ("AgeProperties", [float(min(figure.age, OLDEST)), sure]),
            ("GenderProperties", [0.0 if figure.female else 1.0, sure]),
            ("SmileProperties", [figure.smile, sure]),
            ("ExpressionProperties", [neutral, figure.smile, 0.0, 0.0, 0.0]),
            ("FacialPartsProperties", _parts(seen, seen.face, sure)),
        ):
            self._population.write(known, name, value)
        return True


def confidence(face: SeenFace) -> float:
    """Return how sure the analysis of a face is, 0 to 1: large faces that look at the camera are read best."""
    turned = max(0.0, 1.0 - math.hypot(face.turn[0], face.turn[1]) / _TURNED)
    return min(1.0, face.width * _FOCAL / _SHARP) * turned


def _parts(seen: SeenPerson, face: SeenFace, sure: float) -> list[list]:
    """Return the twelve features: left and right as in the picture, [[x, y] in pixels, confidence]."""
    yaws = {"left": face.eyes[1], "right": face.eyes[0]}  # the person's right eye is on the picture's left
    eye, nose, lips = 0.1 * face.width, 0.12 * face.width, 0.5 * face.lips_width
    points = (
        *(yaws["left"], yaws["right"], face.lips),
        *(_moved(yaws["left"], -eye), _moved(yaws["left"], eye)),
        *(_moved(yaws["right"], eye), _moved(yaws["right"], -eye)),
        *(_moved(face.lips, lips), _moved(face.lips, -lips)),
        *(_moved(face.nose, nose), _moved(face.nose, -nose)),
        (face.lips[0], face.lips[1] - 0.06 * face.height),
    )
    return [[_pixels(point), sure] for point in points]


def _moved(point: tuple[float, float], yaw: float) -> tuple[float, float]:
    return point[0] + yaw, point[1]


def _pixels(point: tuple[float, float]) -> list[float]:
    return [PIXELS / 2 - _FOCAL * math.tan(point[0]), 0.375 * PIXELS + _FOCAL * math.tan(point[1])]
