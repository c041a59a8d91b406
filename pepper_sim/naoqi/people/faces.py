"""Faces in pictures: which are large and straight enough to be found, their values as NAOqi writes them, learned names.

Source: NAOqi 2.8 documentation, page alfacedetection: at least 20 pixels wide, turned by at most 15 degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pepper_sim.body.people_sight import Angles, SeenFace, SeenPerson, Sight
from telepresence.sim.people import Person

PICTURE_WIDTHS = {8: 40, 7: 80, 0: 160, 1: 320, 2: 640, 3: 1280}
"""ALVideoDevice's number of a resolution -> width of its pictures [px]."""
LEAST_WIDTH = 20.0
"""Narrower faces are not found [px]."""
MAX_TURN, MAX_ROLL = math.radians(15.0), math.radians(45.0)
"""A face turned by more than this is not found [rad]; `MAX_TRACKED_TURN`: one that is followed is not lost before."""
MAX_TRACKED_TURN = math.radians(60.0)
SHARP_WIDTH = 40.0
"""Width from which on a face is recognised as well as it can be [px]."""
NAME_MEMORY = 4.0
"""Without any face for this long, names count as new again [s]."""
UNKNOWN_AFTER = 8.0
"""A face that nobody has a name for is worth learning after this time [s]."""
MAX_IMAGES = 10
"""Pictures that are kept of one face."""
_EYE_ZEROS, _LIPS_ZEROS = 8, 10


def focal_length(width: int) -> float:
    """Return the top camera's focal length in pictures of a width [px]."""
    return 0.5 * width / math.tan(math.radians(28.5))


def found(seen: SeenPerson, width: int, turn: float = MAX_TURN) -> bool:
    """Whether the face of somebody is found in pictures of a width [px]."""
    face = seen.face
    if face is None or face.width * focal_length(width) < LEAST_WIDTH:
        return False
    return max(abs(face.turn[0]), abs(face.turn[1])) <= turn and abs(face.turn[2]) <= MAX_ROLL


@dataclass
class _Learned:
    person: Person
    images: int = 1


class FaceDatabase:
    """The faces that the robot has learned, by name."""

    def __init__(self) -> None:
        self._faces: dict[str, _Learned] = {}

    @property
    def names(self) -> list[str]:
        return list(self._faces)

    def learn(self, name: str, person: Person) -> None:
        """Store a face under a new name, or one more picture of it."""
        learned = self._faces.get(name)
        if learned is None or learned.person is not person:
            self._faces[name] = _Learned(person)
        else:
            learned.images = min(MAX_IMAGES, learned.images + 1)

    def forget(self, name: str) -> bool:
        """Remove a name; false if there is none."""
        return self._faces.pop(name, None) is not None

    def clear(self) -> None:
        self._faces.clear()

    def recognise(self, seen: SeenPerson, width: int) -> tuple[str, float]:
        """Return the name of somebody and how sure it is, 0 to 1; ("", 0) for a stranger."""
        if seen.face is None:
            return "", 0.0
        for name, learned in self._faces.items():
            if learned.person is seen.person:
                sharp = min(1.0, seen.face.width * focal_length(width) / SHARP_WIDTH)
                turned = math.hypot(seen.face.turn[0], seen.face.turn[1])
                practice = 0.85 + 0.015 * learned.images
                return name, practice * sharp * max(0.0, 1.0 - turned / MAX_TRACKED_TURN)
        return "", 0.0


class NameFilter:
    """Time_Filtered_Reco_Info: names that are new, each once."""

    def __init__(self) -> None:
        self._named: set[str] = set()
        self._last_face = -math.inf
        self._strange_since: float | None = None

    def filter(self, now: float, names: list[str]) -> list:
        """Return [], [2, [name]], [3, [names]], or [4] for a face that stays unknown; call it while there are faces."""
        if now - self._last_face > NAME_MEMORY:
            self._named.clear()
            self._strange_since = None
        self._last_face = now
        known = [name for name in names if name]
        new = [name for name in known if name not in self._named]
        self._named.update(new)
        if new:
            return [2, new] if len(new) == 1 else [3, new]
        if known:
            self._strange_since = None
        elif self._strange_since is None:
            self._strange_since = now
        elif now - self._strange_since > UNKNOWN_AFTER:
            self._strange_since = now
            return [4]
        return []


def face_info(number: int, face: SeenFace, name: str, score: float) -> list:
    """Return FaceInfo, [ShapeInfo, ExtraInfo], of a face; all places are camera angles [rad]."""
    (x, y), (left, right) = face.middle, face.eyes
    eye, nose = 0.1 * face.width, 0.12 * face.width
    extra = [
        number,
        score,
        name,
        _eye(left, -eye),
        _eye(right, eye),
        0,
        0,
        [*face.nose, face.nose[0] - nose, face.nose[1], face.nose[0] + nose, face.nose[1]],
        _lips(face),
    ]
    return [[0, x, y, face.width, face.height], extra]


def face_detected(sight: Sight, stamp: list[int], faces: list[list], names: list, camera: int) -> list:
    """Return the value of the event FaceDetected."""
    return [stamp, [*faces, names], list(sight.camera_in_torso), list(sight.camera_in_robot), camera]


def _eye(middle: Angles, towards_nose: float) -> list[float]:
    x, y = middle
    return [x, y, x + towards_nose, y, x - towards_nose, y, *[0.0] * _EYE_ZEROS]


def _lips(face: SeenFace) -> list[float]:
    (x, y), half = face.lips, 0.5 * face.lips_width
    return [x + half, y, x - half, y, x, y - 0.06 * face.height, *[0.0] * _LIPS_ZEROS]
