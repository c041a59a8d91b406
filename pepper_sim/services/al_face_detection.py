"""ALFaceDetection: finds, learns and recognises faces in the pictures of the top camera.

While tracking is on, which is the default, one face is followed, the largest, and it may turn away. Source: NAOqi 2.8
documentation, ALFaceDetection; limits: `pepper_sim.naoqi.people.faces`.
"""

from __future__ import annotations

import concurrent.futures
import threading

from pepper_sim.body.people_sight import SeenPerson, Sight
from pepper_sim.naoqi.people.faces import (
    MAX_TRACKED_TURN,
    MAX_TURN,
    PICTURE_WIDTHS,
    FaceDatabase,
    NameFilter,
    face_detected,
    face_info,
    found,
)
from pepper_sim.naoqi.people.population import PERIOD, Look, Population
from pepper_sim.naoqi.service import ServiceError, one_of, remote, within
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.naoqi.vision_extractor import VisionExtractor
from pepper_sim.services.al_memory import ALMemory
from telepresence.sim.people import Person

THRESHOLD = 0.4
EVENT = "FaceDetected"
LEARNING_IMAGES = 5
_TOP_CAMERA = 0


class ALFaceDetection(VisionExtractor):
    """Detects and recognises faces."""

    name = "ALFaceDetection"
    events = (EVENT,)

    def __init__(self, memory: ALMemory, population: Population, workers: Workers) -> None:
        super().__init__(memory)
        self._population = population
        self._workers = workers
        self._database = FaceDatabase()
        self._lock = threading.Lock()
        self._recognition = self._tracking = True
        self._threshold = THRESHOLD
        self._names = NameFilter()
        self._followed: Person | None = None
        self._any = False
        self._numbers: dict[Person, int] = {}
        memory.store(EVENT, [])
        population.watch(lambda: self.active or self._any, self._update, tracks=False)

    # --- learning ----------------------------------------------------------------------------------------------------

    @remote("b(s)")
    def learnFace(self, faceName: str) -> concurrent.futures.Future:
        """Learns the largest face in view under a new name, from five pictures; false if there is none or it exists."""
        return self._workers.run(self._learn, self._checked(faceName), True)

    @remote("b(s)")
    def reLearnFace(self, faceName: str) -> concurrent.futures.Future:
        """Adds a picture of the largest face in view to a name that is known; false if one of the two is missing."""
        return self._workers.run(self._learn, self._checked(faceName), False)

    @remote("b(s)")
    def forgetPerson(self, faceName: str) -> bool:
        """Forgets a face; false if it is unknown."""
        with self._lock:
            return self._database.forget(faceName)

    @remote("b()")
    def clearDatabase(self) -> bool:
        """Forgets all faces."""
        with self._lock:
            self._database.clear()
        return True

    @remote("m()")
    def getLearnedFacesList(self) -> list[str]:
        """Lists the known faces."""
        with self._lock:
            return self._database.names

    @remote("b(s)")
    def importOldDatabase(self, policy: str) -> bool:
        """Imports the faces of a NAOqi before 1.22 ("overwrite", "merge" or "keep"); false: this disk has none."""
        one_of(policy, ("overwrite", "merge", "keep"), "policy")
        return False

    # --- settings ----------------------------------------------------------------------------------------------------

    @remote("v(b)")
    def setRecognitionEnabled(self, enable: bool) -> None:
        """Switches recognition on or off."""
        self._recognition = enable

    @remote("v(b)")
    def enableRecognition(self, enable: bool) -> None:
        """Old name of setRecognitionEnabled."""
        self._recognition = enable

    @remote("b()")
    def isRecognitionEnabled(self) -> bool:
        """Whether recognition is on."""
        return self._recognition

    @remote("v(b)")
    def setTrackingEnabled(self, enable: bool) -> None:
        """Follows one face, even one that turns away, or finds every face anew in each picture."""
        self._tracking = enable

    @remote("v(b)")
    def enableTracking(self, enable: bool) -> None:
        """Old name of setTrackingEnabled."""
        self._tracking = enable

    @remote("b()")
    def isTrackingEnabled(self) -> bool:
        """Whether a face is followed."""
        return self._tracking

    @remote("v(f)")
    def setRecognitionConfidenceThreshold(self, threshold: float) -> None:
        """Sets the confidence from which a face counts as recognised, 0 to 1."""
        self._threshold = within(threshold, 0.0, 1.0, "threshold")

    @remote("f()")
    def getRecognitionConfidenceThreshold(self) -> float:
        """Returns the confidence from which a face counts as recognised."""
        return self._threshold

    # --- for the other services --------------------------------------------------------------------------------------

    def name_of(self, seen: SeenPerson) -> str:
        """Return the name under which somebody's face was learned and is recognised now; "" otherwise."""
        width = PICTURE_WIDTHS[self.getResolution()]
        with self._lock:
            name, score = self._database.recognise(seen, width)
        return name if found(seen, width) and score >= self._threshold else ""

    # --- inside ------------------------------------------------------------------------------------------------------

    def _update(self, look: Look) -> None:
        faces = self._find(look.sight) if self.active else []
        if faces:
            self._any = True
            names = [self._name_and_score(seen) for seen in faces]
            infos = [
                face_info(self._numbers.setdefault(seen.person, len(self._numbers) + 1), seen.face, name, score)
                for seen, (name, score) in zip(faces, names, strict=True)
                if seen.face is not None
            ]
            new = self._names.filter(look.sight.time, [name for name, _ in names])
            stamp = split_stamp(look.sight.stamp)
            self.memory.announce(EVENT, face_detected(look.sight, stamp, infos, new, _TOP_CAMERA))
        elif self._any:
            self._any = False
            self.memory.announce(EVENT, [])

    def _find(self, sight: Sight) -> list[SeenPerson]:
        if self.getActiveCamera() != _TOP_CAMERA:
            return []  # the bottom camera shows the floor
        width = PICTURE_WIDTHS[self.getResolution()]
        if not self._tracking:
            self._followed = None
            return [seen for seen in sight.people if found(seen, width)]
        found_now = [
            seen
            for seen in sight.people
            if found(seen, width, MAX_TRACKED_TURN if seen.person is self._followed else MAX_TURN)
        ]
        if all(seen.person is not self._followed for seen in found_now):
            self._followed = found_now[0].person if found_now else None
        return [seen for seen in found_now if seen.person is self._followed]

    def _name_and_score(self, seen: SeenPerson) -> tuple[str, float]:
        if not self._recognition:
            return "", 0.0
        with self._lock:
            name, score = self._database.recognise(seen, PICTURE_WIDTHS[self.getResolution()])
        return (name, score) if score >= self._threshold else ("", score)

    def _checked(self, name: str) -> str:
        if not name:
            raise ServiceError("faceName must not be empty")
        return name

    def _learn(self, name: str, new: bool) -> bool:
        learned = False
        with self._lock:
            if (name in self._database.names) == new:
                return False
        for _ in range(LEARNING_IMAGES if new else 1):
            width = PICTURE_WIDTHS[self.getResolution()]
            faces = [seen for seen in self._population.look_now().people if found(seen, width)]
            if faces:
                with self._lock:
                    self._database.learn(name, faces[0].person)
                learned = True
            if self._workers.closing.wait(PERIOD):
                break
        return learned
