"""ALSegmentation3D: objects in the depth picture (NAOqi 2.1 documentation; 2.5 still has the service, 2.8 does not)."""

from __future__ import annotations

import concurrent.futures
import math
from dataclasses import dataclass

import numpy as np

from pepper_sim.naoqi.service import ServiceError, one_of, remote
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.naoqi.video.streams import Cursor
from pepper_sim.naoqi.vision import depth
from pepper_sim.naoqi.vision.picture_extractor import DEPTH, AdjustableExtractor
from pepper_sim.naoqi.vision.pictures import ROBOT, TORSO, WORLD, Picture
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

UPDATED, TRACKER_UPDATED, LOST, BLOBS, TOP = (
    f"Segmentation3D/{key}"
    for key in ("SegmentationUpdated", "BlobTrackerUpdated", "TrackedBlobNotFound", "BlobsList", "TopOfTrackedBlob")
)
TRACKED = "ALTracker/BlobDetected"
_IMAGE_FRAME, _NEAREST_BLOB = -1, -1.0
_LEAST_SHARE = 0.01
"""A blob has at least this share of the picture's pixels."""
_SAME_DISTANCE = 0.3
"""How far a blob may be from the distance at which it is looked for [m]."""


@dataclass(frozen=True)
class _Blob:
    """A part of the depth picture: centre and top [px], rectangle [px], mean distance [m]."""

    centre: tuple[float, float]
    box: tuple[int, int, int, int]
    distance: float
    top: tuple[int, int]


class ALSegmentation3D(AdjustableExtractor):
    """Cuts the depth picture into blobs of similar depth, and follows one."""

    name = "ALSegmentation3D"
    events = (UPDATED, TRACKER_UPDATED, LOST, TRACKED)
    cameras = (2,)
    space = DEPTH

    def __init__(self, memory: ALMemory, video: ALVideoDevice, workers: Workers) -> None:
        super().__init__(memory, video)
        self._workers = workers
        self._threshold, self._offset = depth.SAME, -0.2
        self._tracking, self._distance = False, _NEAREST_BLOB
        memory.declare((BLOBS, TOP), self.name)

    @remote("f()")
    def getDeltaDepthThreshold(self) -> float:
        """Returns by how much the depths of neighbours in one blob differ at most [m]."""
        return self._threshold

    @remote("v(f)")
    def setDeltaDepthThreshold(self, threshold: float) -> None:
        """Sets by how much the depths of neighbours in one blob differ at most [m]."""
        if threshold <= 0.0:
            raise ServiceError(f"threshold must be positive, got {threshold:g}")
        self._threshold = threshold

    @remote("f()")
    def getBlobTrackingDistance(self) -> float:
        """Returns the distance of the tracked blob [m]; -1 for the nearest."""
        return self._distance

    @remote("v(f)")
    def setBlobTrackingDistance(self, distance: float) -> None:
        """Sets the distance of the blob to track [m]; -1 for the nearest."""
        self._distance = _checked_distance(distance, "distance")

    @remote("b()")
    def isBlobTrackingEnabled(self) -> bool:
        """Whether a blob is tracked."""
        return self._tracking

    @remote("v(b)")
    def setBlobTrackingEnabled(self, status: bool) -> None:
        """Switches tracking on or off. It raises events; ALTracker.trackEvent moves the head after them."""
        self._tracking = status

    @remote("f()")
    def getVerticalOffset(self) -> float:
        """Returns what is added to the height of a blob's top [m]."""
        return self._offset

    @remote("v(f)")
    def setVerticalOffset(self, offset: float) -> None:
        """Sets what is added to the height of a blob's top, so that a person's eyes are meant [m]."""
        self._offset = offset

    @remote("m(fib)")
    def getTopOfBlob(self, dist: float, frame: int, applyVerticalOffset: bool) -> concurrent.futures.Future:
        """Returns the top of the most central blob at a distance, -1 for the nearest: angles and distance in the
        picture for frame -1, or x, y, z in frame 0, 1 or 2; empty if there is none."""
        _checked_distance(dist, "dist")
        one_of(frame, (_IMAGE_FRAME, TORSO, WORLD, ROBOT), "frame")
        return self._workers.run(self._top_of_blob, dist, frame, applyVerticalOffset)

    def _top_of_blob(self, dist: float, frame: int, with_offset: bool) -> list[float]:
        camera, resolution, period = self.view()
        picture = self._video.picture(camera, resolution, self.space, 1.0 / period, Cursor())
        blob = None if picture is None else _choose(picture, self._blobs(picture), dist)
        if picture is None or blob is None:
            return []
        angles = self._top(picture, blob, with_offset)
        if frame == _IMAGE_FRAME:
            return [*angles, blob.distance]
        ahead, (yaw, pitch) = blob.distance, angles
        seen = picture.poses[frame] @ (ahead, ahead * math.tan(yaw), -ahead * math.tan(pitch), 1.0)
        return [*map(float, seen[:3])]

    def detect(self, picture: Picture) -> None:
        blobs = self._blobs(picture)
        infos = [_info(picture, blob) for blob in blobs]
        self.memory.store(BLOBS, [picture.time_stamp, infos, *picture.origin])
        self.memory.announce(UPDATED, 1)
        if not self._tracking:
            return
        blob = _choose(picture, blobs, self._distance)
        if blob is None:
            self.memory.announce(LOST, 1)
            return
        if self._distance != _NEAREST_BLOB:
            self._distance = blob.distance
        angles = self._top(picture, blob, True)
        self.memory.store(TOP, [picture.time_stamp, [*angles, blob.distance], *picture.origin])
        self.memory.announce(TRACKER_UPDATED, 1)
        self.memory.announce(TRACKED, picture.target(*blob.top, blob.distance))

    def _blobs(self, picture: Picture) -> list[_Blob]:
        metres = picture.pixels.astype(np.float32) / 1000.0
        labels, boxes, centres = depth.segments(metres, self._threshold)
        found = []
        for label in range(1, len(boxes)):
            x, y, width, height, amount = map(int, boxes[label])
            if amount < _LEAST_SHARE * metres.size:
                continue
            inside = labels == label
            column = int(np.clip(round(centres[label][0]), x, x + width - 1))
            rows = np.flatnonzero(inside[:, column])
            top = (column, int(rows[0]) if len(rows) else y)
            distance = float(metres[inside].mean())
            centre = (float(centres[label][0]), float(centres[label][1]))
            found.append(_Blob(centre, (x, y, width, height), distance, top))
        return found

    def _top(self, picture: Picture, blob: _Blob, with_offset: bool) -> list[float]:
        yaw, pitch = picture.angles(*blob.top)
        if with_offset and blob.top[1] > 0:  # no offset where the picture cuts the blob off
            pitch = math.atan(math.tan(pitch) - self._offset / blob.distance)
        return [yaw, pitch]


def _info(picture: Picture, blob: _Blob) -> list:
    """Return BlobInfo."""
    return [
        picture.angles(*blob.centre),
        picture.box(*blob.box),
        blob.distance,
        depth.real_size(picture, *blob.box[2:], blob.distance),
        picture.angles(*blob.top),
    ]


def _choose(picture: Picture, blobs: list[_Blob], distance: float) -> _Blob | None:
    """Return the nearest blob, or the one that is most in the middle among those at a distance."""
    if distance == _NEAREST_BLOB:
        return min(blobs, key=lambda blob: blob.distance, default=None)
    height, width = picture.pixels.shape[:2]
    middle = (width / 2.0, height / 2.0)
    near = [blob for blob in blobs if abs(blob.distance - distance) <= _SAME_DISTANCE]
    return min(near, key=lambda blob: math.dist(blob.centre, middle), default=None)


def _checked_distance(value: float, argument: str) -> float:
    if value != _NEAREST_BLOB and value <= 0.0:
        raise ServiceError(f"{argument} must be positive, or -1 for the nearest blob; got {value:g}")
    return value
