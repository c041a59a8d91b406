"""ALVisionRecognition: pictures that were learned before, found again by their key points (OpenCV's ORB).

A database is a folder on the robot's disk with the learned pictures and `objects.json`, which names them. Source: NAOqi
2.8 documentation, alvisionrecognition.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import cv2
import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import ServiceError, one_of, remote, shown, within
from pepper_sim.naoqi.vision.picture_extractor import PictureExtractor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

EVENT = "PictureDetected"
DATABASES = "/home/nao/naoqi/.local/share/naoqi/vision/visionrecognition"
_DEFAULT_NAME = "current"
_INDEX = "objects.json"
_MOST_OBJECTS = 10
_LEAST_MATCHES = 12
_DISTINCT = 0.8
"""A key point counts if its best match is this much better than the second."""
_OLD_PARAMETERS = ("resolution", "scoreThreshold")


@dataclass(frozen=True)
class _Object:
    """Something learned: where it came from, its names, its outline and its key points in the learned picture."""

    source: str
    labels: list[str]
    picture: str
    outline: list[list[float]]
    points: np.ndarray
    descriptors: np.ndarray


class ALVisionRecognition(PictureExtractor):
    """Recognises learned pictures."""

    name = "ALVisionRecognition"
    events = (EVENT,)

    def __init__(self, memory: ALMemory, video: ALVideoDevice, disk: RobotDisk) -> None:
        super().__init__(memory, video)
        self._disk = disk
        self._lock = threading.Lock()
        self._path, self._name = DATABASES, _DEFAULT_NAME
        self._objects: list[_Object] = []
        self._most = 1
        self._detector = cv2.ORB.create(nfeatures=1500)
        self._matcher = cv2.BFMatcher(cv2.NORM_HAMMING)

    # --- the database ------------------------------------------------------------------------------------------------

    @remote("b(ss)")
    def changeDatabase(self, databasePath: str, databaseName: str) -> bool:
        """Uses another database, by folder and name; "" stands for the default. A new one is empty."""
        path, name = databasePath or DATABASES, databaseName or _DEFAULT_NAME
        if not path.startswith("/") or "/" in name or name in (".", ".."):
            raise ServiceError("databasePath must be absolute, and databaseName the name of a folder in it")
        folder = self._disk.output(f"{path}/{name}")
        with self._lock:
            try:
                self._objects = self._load(folder)
            except (OSError, ValueError, KeyError, TypeError):
                return False
            self._path, self._name = path, name
        return True

    @remote("v()")
    def clearCurrentDatabase(self) -> None:
        """Forgets everything in the database, and deletes its files; others in its folder, which may be any, stay."""
        with self._lock:
            folder = self._folder()
            for file in (_INDEX, *(known.picture for known in self._objects)):
                with contextlib.suppress(OSError):
                    (folder / file).unlink()
            self._objects = []

    @remote("i()")
    def getSize(self) -> int:
        """Returns how many objects the database has."""
        return len(self._objects)

    @remote("b(ss[s]bb)")
    def learnFromFile(self, filename: str, name: str, tags: list[str], isWholeImage: bool, forced: bool) -> bool:
        """Learns a picture; one of this file that is known already is replaced if `forced`. False if that fails."""
        if not name:
            raise ServiceError("name must not be empty")
        path = self._disk.path(filename)
        pixels = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if path.is_file() else None
        if pixels is None:
            return False
        with self._lock:
            if not forced and filename in (known.source for known in self._objects):
                return False
            found = self._learn(pixels, filename, [name, *tags], isWholeImage)
            if found is None:
                return False
            self._objects = [known for known in self._objects if known.source != filename] + [found]
            self._save(found, pixels)
        return True

    @remote("i()")
    def getMaxOutObjs(self) -> int:
        """Returns how many objects are reported at most."""
        return self._most

    @remote("v(i)")
    def setMaxOutObjs(self, maxOutObjs: int) -> None:
        """Sets how many objects are reported at most, 1 to 10."""
        self._most = int(within(maxOutObjs, 1, _MOST_OBJECTS, "maxOutObjs"))

    @remote("s(s)")
    def getParam(self, paramName: str) -> str:
        """Returns "db_path" or "db_name"."""
        return {"db_path": self._path, "db_name": self._name}[one_of(paramName, ("db_path", "db_name"), "paramName")]

    @remote("v(sm)")
    def setParam(self, paramName: str, paramValue: Any) -> None:
        """Does nothing any more, as on the robot (deprecated)."""
        one_of(paramName, _OLD_PARAMETERS, "paramName")

    # --- recognition -------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def detectFromFile(self, filename: str) -> None:
        """Looks for learned objects in a picture file, and raises PictureDetected if there are any."""
        path = self._disk.path(filename)
        pixels = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB) if path.is_file() else None
        if pixels is None:
            raise ServiceError(f"filename: there is no picture {shown(filename)}")
        camera = self._video.settings.cameras[self.camera]
        self.detect(Picture(camera, pixels, path.stat().st_mtime, {}))

    def detect(self, picture: Picture) -> None:
        with self._lock:
            known = list(self._objects)
        if not known:
            return
        points, descriptors = self._key_points(cv2.cvtColor(picture.pixels, cv2.COLOR_RGB2GRAY))
        if descriptors is None:
            return
        found: list[list[Any]] = []
        for one in known:
            seen = self._find(one, points, descriptors)
            if seen is not None:
                matches, corners = seen
                boundary = [picture.angles(*corner) for corner in corners]
                found.append([one.labels, matches, matches / len(one.points), boundary])
        if found:
            found.sort(key=lambda info: -info[1])
            self.memory.announce(EVENT, [picture.time_stamp, found[: self._most]])

    def _find(self, one: _Object, points: np.ndarray, descriptors: np.ndarray) -> tuple[int, np.ndarray] | None:
        """Return how many key points of an object are in the picture, and where its corners are [px]."""
        pairs = [pair for pair in self._matcher.knnMatch(one.descriptors, descriptors, k=2) if len(pair) == 2]
        good = [first for first, second in pairs if first.distance < _DISTINCT * second.distance]
        if len(good) < _LEAST_MATCHES:
            return None
        learned = np.array([one.points[match.queryIdx] for match in good], np.float32)
        seen = np.array([points[match.trainIdx] for match in good], np.float32)
        homography, inliers = cv2.findHomography(learned, seen, cv2.RANSAC, 4.0)
        matches = 0 if inliers is None else int(inliers.sum())
        if homography is None or matches < _LEAST_MATCHES:
            return None
        corners = cv2.perspectiveTransform(np.array([one.outline], np.float32), homography)[0]
        return (matches, corners) if cv2.isContourConvex(corners.astype(np.float32)) else None

    def _key_points(self, grey: np.ndarray, mask: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray | None]:
        everywhere = np.full_like(grey, 255) if mask is None else mask
        found, descriptors = self._detector.detectAndCompute(grey, everywhere)
        return np.array([point.pt for point in found], np.float32), descriptors

    def _learn(self, grey: np.ndarray, source: str, labels: list[str], whole: bool) -> _Object | None:
        height, width = grey.shape
        x, y, w, h = (0, 0, width, height) if whole else _foreground(grey)
        mask = np.zeros_like(grey)
        mask[y : y + h, x : x + w] = 255
        points, descriptors = self._key_points(grey, mask)
        if descriptors is None or len(points) < _LEAST_MATCHES:
            return None
        outline = [[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
        picture = f"{hashlib.sha256(source.encode()).hexdigest()[:16]}.png"
        return _Object(source, labels, picture, [[float(a), float(b)] for a, b in outline], points, descriptors)

    # --- files -------------------------------------------------------------------------------------------------------

    def _folder(self) -> Path:
        return self._disk.path(f"{self._path}/{self._name}")

    def _save(self, one: _Object, grey: np.ndarray) -> None:
        folder = self._folder()
        folder.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(folder / one.picture), grey)
        rows = [
            {key: vars(known)[key] for key in ("source", "labels", "picture", "outline")} for known in self._objects
        ]
        (folder / _INDEX).write_text(json.dumps(rows))

    def _load(self, folder: Path) -> list[_Object]:
        if not (folder / _INDEX).is_file():
            return []
        loaded = []
        for row in json.loads((folder / _INDEX).read_text()):
            picture = PurePosixPath(row["picture"]).name
            grey = cv2.imread(str(folder / picture), cv2.IMREAD_GRAYSCALE)
            if grey is None:
                raise ValueError(f"{picture} is no picture")
            one = self._learn(grey, row["source"], row["labels"], True)
            if one is not None:
                loaded.append(_Object(**{**vars(one), "picture": picture, "outline": row["outline"]}))
        return loaded


def _foreground(grey: np.ndarray) -> Sequence[int]:
    """Return x, y, width and height of what stands out from a background of one brightness [px]."""
    edges = np.concatenate([grey[0], grey[-1], grey[:, 0], grey[:, -1]])
    different = np.abs(grey.astype(np.int16) - int(np.median(edges))) > 25
    return cv2.boundingRect(different.astype(np.uint8))
