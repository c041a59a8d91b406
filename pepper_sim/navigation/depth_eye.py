"""Depth eye: turns the head, looks with the depth camera, and finds what stands or hangs above the floor.

The lasers look over the floor and see the legs of a table; the depth camera sees its board.
"""

from __future__ import annotations

import math

import numpy as np

from pepper_sim.navigation.behaviours import Behaviour, pause
from pepper_sim.navigation.scans import relative, transform
from pepper_sim.navigation.surveyor import Surveyor
from pepper_sim.robot import Pepper
from telepresence.geometry import Pose

WIDTH, HEIGHT, RATE = 80, 60, 5.0
"""Size [px] and rate [Hz] of the pictures."""
NEAREST, FARTHEST = 0.4, 3.0
"""Distances along the optical axis that are used [m]; the camera measures from 0.4 m, and loses precision beyond."""
LOWEST, HIGHEST = 0.12, 1.25
"""Heights above the floor at which something is in the robot's way [m]."""
BODY = 0.45
"""What is nearer to the middle of the robot is its own body [m]."""
DIRECTIONS = (0.0, 0.9, -0.9)
"""Headings of the head for one look around [rad]."""
PITCH = 0.2

_PATIENCE = 25  # resumptions that a turn of the head or a picture may take


class DepthEye:
    """The depth camera of one robot as what `behaviours` look around with."""

    def __init__(self, robot: Pepper, surveyor: Surveyor) -> None:
        self._robot = robot
        self._surveyor = surveyor

    def look_around(self) -> Behaviour[None]:
        """Turn the head to each of the directions and hand what is seen there to the surveyor."""
        with self._robot.subscribe_camera("CameraDepth", WIDTH, HEIGHT, RATE, "depth") as feed:
            for yaw in DIRECTIONS:
                self._robot.set_angles({"HeadYaw": yaw, "HeadPitch": PITCH}, {"HeadYaw": 1.5, "HeadPitch": 1.5})
                for _ in range(_PATIENCE):
                    yield
                    if abs(self._robot.snapshot().joint_positions["HeadYaw"] - yaw) < 0.02:
                        break
                yield from pause(0.1)
                settled = self._robot.snapshot().stamp
                for _ in range(_PATIENCE):
                    yield
                    picture = feed.image.peek()
                    if picture is not None and picture.stamp > settled:
                        self._surveyor.add_depth(self._obstacles(picture.content))
                        break
            self._robot.set_angles({"HeadYaw": 0.0}, {"HeadYaw": 1.5})

    def _obstacles(self, depth: np.ndarray) -> np.ndarray:
        """Return what stands or hangs in the robot's way, in base_footprint, shape (n, 2) [m]."""
        camera = self._robot.link_pose("CameraDepth_frame")
        lens = self._robot.world.model.camera(self._robot.cameras["CameraDepth"][0])
        focal = 0.5 * HEIGHT / math.tan(0.5 * math.radians(float(lens.fovy[0])))
        v, u = np.mgrid[:HEIGHT, :WIDTH]
        near = (depth >= NEAREST) & (depth <= FARTHEST)
        along = depth[near]
        left = -(u[near] - (WIDTH - 1) / 2) / focal * along
        up = -(v[near] - (HEIGHT - 1) / 2) / focal * along
        points = np.stack([along, left, up], axis=1) @ camera[:3, :3].T + camera[:3, 3]
        points = points[(points[:, 2] >= LOWEST) & (points[:, 2] <= HIGHEST)]
        here = self._surveyor.odometry()
        flat = transform(relative(here, Pose(0.0, 0.0, 0.0)), points[:, :2])
        return flat[np.hypot(flat[:, 0], flat[:, 1]) > BODY]
