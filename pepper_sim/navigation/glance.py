"""A glance: turn the head, wait until it is still, and take one picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pepper_sim.navigation.behaviours import Behaviour, pause
from pepper_sim.robot import Pepper

_SPEED = 3.0  # of the head [rad/s]
_PATIENCE = 25  # resumptions that a turn of the head, or a picture, may take


@dataclass(frozen=True)
class View:
    """What a camera saw.

    Args:
        pixels: `(height, width, 3) uint8, RGB`.
        focal: Focal length [px].
        stamp: When it was taken [s since 1970].
    """

    pixels: np.ndarray
    focal: float
    stamp: float


def glance(robot: Pepper, camera: str, width: int, height: int, yaw: float, pitch: float) -> Behaviour[View | None]:
    """Look with the head at (yaw, pitch) [rad]; None if no picture came, as from a robot without cameras."""
    if not robot.has_cameras:
        return None
    robot.set_angles({"HeadYaw": yaw, "HeadPitch": pitch}, {"HeadYaw": _SPEED, "HeadPitch": _SPEED})
    for _ in range(_PATIENCE):
        yield
        joints = robot.snapshot().joint_positions
        if abs(joints["HeadYaw"] - yaw) < 0.02 and abs(joints["HeadPitch"] - pitch) < 0.02:
            break
    yield from pause(0.1)
    settled = robot.snapshot().stamp
    with robot.subscribe_camera(camera, width, height, 10.0) as feed:
        for _ in range(_PATIENCE):
            yield
            picture = feed.image.peek()
            if picture is not None and picture.stamp >= settled:
                return View(picture.content, focal_length(robot, camera, height), picture.stamp)
    return None


def focal_length(robot: Pepper, camera: str, height: int) -> float:
    """Return the focal length of a camera for pictures of a height [px]."""
    lens = robot.world.model.camera(robot.cameras[camera][0])
    return 0.5 * height / math.tan(0.5 * math.radians(float(lens.fovy[0])))
