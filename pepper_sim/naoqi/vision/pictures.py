"""A picture with what a detector needs to say where something is: the camera's field of view and pose."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from pepper_sim.body.frames import roll_pitch_yaw
from pepper_sim.naoqi.motion.frames import FRAME_LINKS, SENSORS
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.naoqi.video.streams import Camera
from pepper_sim.robot import Pepper

TORSO, WORLD, ROBOT = 0, 1, 2
"""ALMotion's frames."""


@dataclass(frozen=True)
class Picture:
    """A picture of one camera.

    Args:
        camera: Where it comes from.
        pixels: (height, width, ...) in the colour space that was requested.
        stamp: When it was taken [s since 1970].
        poses: Frame -> the camera's pose in it: a homogeneous matrix, x along the line of sight, y left, z up.
    """

    camera: Camera
    pixels: np.ndarray
    stamp: float
    poses: dict[int, np.ndarray]

    @property
    def time_stamp(self) -> list[int]:
        """[seconds, microseconds] at which it was taken."""
        return split_stamp(self.stamp)

    @property
    def origin(self) -> list:
        """The end of every vision event: the camera's Position6D in FRAME_TORSO and FRAME_ROBOT, and its number."""
        return [position6d(self.poses[TORSO]), position6d(self.poses[ROBOT]), self.camera.index]

    def angles(self, x: float, y: float) -> list[float]:
        """Return the direction of a pixel: counter-clockwise about z, and about y, which is down [rad]."""
        height, width = self.pixels.shape[:2]
        left, down = 1.0 - 2.0 * (x + 0.5) / width, 2.0 * (y + 0.5) / height - 1.0
        tangents = math.tan(self.camera.fovx / 2.0), math.tan(self.camera.fovy / 2.0)
        return [math.atan(left * tangents[0]), math.atan(down * tangents[1])]

    def extent(self, x: float, y: float, width: float, height: float) -> list[float]:
        """Return the angles that a rectangle around a pixel covers, across and down [rad]."""
        left, top = self.angles(x - width / 2.0, y - height / 2.0)
        right, bottom = self.angles(x + width / 2.0, y + height / 2.0)
        return [left - right, bottom - top]

    def box(self, x: float, y: float, width: float, height: float) -> list[float]:
        """Return NAOqi's AngularRoi of a rectangle: the direction of its top left corner, and its size [rad]."""
        return [*self.angles(x, y), *self.extent(x + width / 2.0, y + height / 2.0, width, height)]

    def point(self, x: float, y: float, distance: float, frame: int) -> list[float]:
        """Return the Position6D of what a pixel shows at a distance along the line of sight, seen from a frame [m]."""
        yaw, pitch = self.angles(x, y)
        seen = self.poses[frame] @ (distance, distance * math.tan(yaw), -distance * math.tan(pitch), 1.0)
        return [*map(float, seen[:3]), 0.0, 0.0, 0.0]

    def target(self, x: float, y: float, distance: float) -> list:
        """Return the value of an event that ALTracker.trackEvent follows: positions, time stamp and effector."""
        positions = [self.point(x, y, distance, frame) for frame in (TORSO, ROBOT)]
        return [*positions, self.time_stamp, {0: 1, 1: 2}.get(self.camera.index, 0)]


def position6d(pose: np.ndarray) -> list[float]:
    """Return [x, y, z, wx, wy, wz] of a pose."""
    return [*map(float, pose[:3, 3]), *map(float, roll_pitch_yaw(pose[:3, :3]))]


def camera_poses(robot: Pepper, name: str) -> dict[int, np.ndarray]:
    """Return frame -> pose of the camera called `name`, all of the same instant."""
    with robot.world.locked():
        camera = robot.link_pose(SENSORS[name])
        frames = {frame: None if link is None else robot.link_pose(link) for frame, link in FRAME_LINKS.items()}
    return {frame: camera if pose is None else np.linalg.inv(pose) @ camera for frame, pose in frames.items()}


@functools.lru_cache(maxsize=16)
def closest_resolution(wanted: tuple[int, int], offered: tuple[tuple[int, tuple[int, int]], ...]) -> int:
    """Return the number of the offered size that is most like the wanted one.

    Args:
        wanted: Width and height [px].
        offered: Number, and width and height.
    """
    return min(offered, key=lambda entry: abs(math.log(entry[1][0] / wanted[0])))[0]
