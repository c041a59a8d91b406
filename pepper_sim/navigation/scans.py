"""Scans: what the three lasers of the base read at one instant, as points around the robot.

The lasers look over the floor in three sectors of 60 degrees with 15 rays each; between them they see nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pepper_sim.body.description import LASER_MAX
from pepper_sim.body.state import Snapshot
from telepresence.geometry import Pose, wrap_angle

LASER_PLACES = {
    "Front": (0.0562, 0.0, 0.0),
    "Left": (-0.018, 0.0899, 1.75728),
    "Right": (-0.018, -0.0899, -1.75728),
}
"""Frame under each laser's camera in base_footprint (x, y [m], yaw [rad]): the URDF's Surrounding*Laser_frame."""

_REACHED = LASER_MAX + 0.2  # a reading beyond this is the point that stands for "nothing hit"; the rest is noise


@dataclass(frozen=True)
class Scan:
    """One reading of all lasers in base_footprint, x forward and y left [m].

    Args:
        points: Where each ray ends, shape (45, 2).
        origins: Where each ray starts, shape (45, 2).
        hit: Whether it ended at an obstacle; else nothing was there within the lasers' range.
        odometry: Pose by the wheels at that instant.
    """

    points: np.ndarray
    origins: np.ndarray
    hit: np.ndarray
    odometry: Pose

    @property
    def obstacles(self) -> np.ndarray:
        """The points that belong to obstacles, shape (n, 2)."""
        return self.points[self.hit]


def read_scan(snapshot: Snapshot) -> Scan:
    """Return the newest scan of a snapshot. A ray that hit nothing ends at the lasers' practical range."""
    points, origins, hits = [], [], []
    for side, (x, y, yaw) in LASER_PLACES.items():
        local = snapshot.laser[side]
        lengths = np.hypot(local[:, 0], local[:, 1])
        hit = lengths <= _REACHED
        local = np.where(hit[:, None], local, local * (LASER_MAX / lengths)[:, None])
        points.append(transform(Pose(x, y, yaw), local))
        origins.append(np.tile((x, y), (len(local), 1)))
        hits.append(hit)
    return Scan(np.concatenate(points), np.concatenate(origins), np.concatenate(hits), Pose(*snapshot.laser_odometry))


def transform(pose: Pose, points: np.ndarray) -> np.ndarray:
    """Return points (..., 2) that are given in the frame at `pose` in that pose's own frame."""
    c, s = np.cos(pose.theta), np.sin(pose.theta)
    return points @ np.array([[c, s], [-s, c]]) + (pose.x, pose.y)


def compose(first: Pose, second: Pose) -> Pose:
    """Return the pose of `second`, which is given in the frame at `first`."""
    c, s = np.cos(first.theta), np.sin(first.theta)
    x, y = first.x + c * second.x - s * second.y, first.y + s * second.x + c * second.y
    return Pose(float(x), float(y), wrap_angle(first.theta + second.theta))


def relative(origin: Pose, pose: Pose) -> Pose:
    """Return `pose` in the frame at `origin`."""
    c, s = np.cos(origin.theta), np.sin(origin.theta)
    dx, dy = pose.x - origin.x, pose.y - origin.y
    return Pose(float(c * dx + s * dy), float(c * dy - s * dx), wrap_angle(pose.theta - origin.theta))
