"""ALMovementDetection: what changed between two pictures, in depth or in colour (NAOqi 2.8 documentation).

It looks only while the robot itself stands still, as documented.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from pepper_sim.naoqi.service import ServiceError, remote, within
from pepper_sim.naoqi.vision import depth
from pepper_sim.naoqi.vision.picture_extractor import DEPTH, RGB, AdjustableExtractor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

DETECTED, NONE, INFO = (f"MovementDetection/{key}" for key in ("MovementDetected", "NoMovement", "MovementInfo"))
_DEPTH_CAMERA = 2
_LEAST_PIXELS = 40
_STANDING = 0.01
"""Speed up to which the robot counts as standing [m/s, rad/s]."""
_GROWN = np.ones((5, 5), np.uint8)


class ALMovementDetection(AdjustableExtractor):
    """Detects movement before the camera."""

    name = "ALMovementDetection"
    events = (DETECTED, NONE)
    cameras = (_DEPTH_CAMERA, 0, 1)

    def __init__(self, memory: ALMemory, video: ALVideoDevice, robot: Pepper) -> None:
        super().__init__(memory, video)
        self._robot = robot
        self._depth_sensitivity, self._colour_sensitivity = 0.1, 0.85
        self._before: np.ndarray | None = None
        memory.declare((INFO,), self.name)

    @remote("v()")
    def resetDetection(self) -> None:
        """Forgets the last picture."""
        self._before = None

    @remote("f()")
    def getDepthSensitivity(self) -> float:
        """Returns by how much a pixel's depth must change to count as movement [m]."""
        return self._depth_sensitivity

    @remote("v(f)")
    def setDepthSensitivity(self, sensitivity: float) -> None:
        """Sets by how much a pixel's depth must change to count as movement [m]."""
        if sensitivity <= 0.0:
            raise ServiceError(f"sensitivity must be positive, got {sensitivity:g}")
        self._depth_sensitivity = sensitivity

    @remote("f()")
    def getColorSensitivity(self) -> float:
        """Returns the sensitivity for the colour cameras, 0 to 1."""
        return self._colour_sensitivity

    @remote("v(f)")
    def setColorSensitivity(self, sensitivity: float) -> None:
        """Sets the sensitivity for the colour cameras, 0 to 1: the lower, the larger a change must be."""
        self._colour_sensitivity = within(sensitivity, 0.0, 1.0, "sensitivity")

    @property
    def space(self) -> int:  # type: ignore[override]  # it follows the camera
        return DEPTH if self.getActiveCamera() == _DEPTH_CAMERA else RGB

    def detect(self, picture: Picture) -> None:
        if self._moves():
            self._before = None
            return
        is_depth = picture.pixels.ndim == 2
        if is_depth:
            now, limit = picture.pixels.astype(np.float32) / 1000.0, self._depth_sensitivity
        else:
            now, limit = cv2.cvtColor(picture.pixels, cv2.COLOR_RGB2GRAY).astype(np.float32), self._colour_limit()
        before, self._before = self._before, now
        if before is None or before.shape != now.shape:
            return
        moving = np.abs(now - before) > limit
        if is_depth:
            moving &= (now > 0.0) & (before > 0.0)
        clusters = _clusters(picture, moving, now if is_depth else None)
        if clusters:
            self.memory.store(INFO, [picture.time_stamp, clusters, *picture.origin])
            self.memory.announce(DETECTED, 1)
        else:
            self.memory.announce(NONE, 1)

    def nobody_looks(self) -> None:
        self._before = None

    def _colour_limit(self) -> float:
        return max(1.0, 255.0 * (1.0 - self._colour_sensitivity))

    def _moves(self) -> bool:
        snapshot = self._robot.snapshot()
        return max(map(abs, (*snapshot.velocity, *snapshot.joint_velocities.values()))) > _STANDING


def _clusters(picture: Picture, moving: np.ndarray, metres: np.ndarray | None) -> list[list]:
    """Return ClusterInfo of every group of moving pixels, the largest first."""
    joined = cv2.dilate(moving.astype(np.uint8), _GROWN)
    count, labels, boxes, centres = cv2.connectedComponentsWithStats(joined, connectivity=8)
    found = []
    for label in range(1, count):
        pixels = moving & (labels == label)
        amount = int(pixels.sum())
        if amount < _LEAST_PIXELS:
            continue
        x, y, width, height, _ = map(int, boxes[label])
        info: list[Any] = [
            picture.angles(*centres[label]),
            picture.box(x, y, width, height),
            [amount / moving.size, amount / (width * height)],
        ]
        if metres is not None:
            distance = float(metres[pixels].mean())
            top = depth.top_above(metres, *centres[label])
            info += [distance, depth.real_size(picture, width, height, distance), picture.angles(*top)]
        found.append((amount, info))
    return [info for _, info in sorted(found, key=lambda entry: -entry[0])]
