"""The optional laser scanner in front, as the REST interface's scan0 shows it.

Source: a scan of a real robot, alexkorga/hsbi-robotino-navigation, docs/reference/robotino_http_api_inventory.md: 441
ranges, -110 degrees to +110.5 degrees (one step more than the last ray), 0 to 20 m, 0 for no return. Its make isn't
named; period and noise are those of scanners of this class and not the robot's own figures.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from telepresence.sim.rays import Rays, add_noise, fan
from telepresence.sim.stillness import Stillness

COUNT = 441
ANGLE_MIN, ANGLE_MAX, ANGLE_INCREMENT = -1.9198628664, 1.9285876751, 0.0087266453
"""[rad]"""
RANGE_MIN, RANGE_MAX = 0.0, 20.0
"""[m]"""
PERIOD = 0.1
"""[s]"""
NOISE = 0.01
"""Standard deviation [m]."""
RESOLUTION = 0.001
"""[m]"""


@dataclass(frozen=True)
class Scan:
    """`ranges` counter-clockwise from `ANGLE_MIN` [m], 0 for no return; `stamp` is the middle of the scan [s]."""

    seq: int
    stamp: float
    ranges: tuple[float, ...]


class LaserScanner:
    """One scanner at the model's site `laser`. `measure` needs the world's lock.

    Args:
        rng: Draws the noise; None for none.
    """

    def __init__(self, model: mujoco.MjModel, prefix: str, rng: np.random.Generator | None = None) -> None:
        angles = ANGLE_MIN + ANGLE_INCREMENT * np.arange(COUNT)
        self._rays = Rays(model, [(prefix + "laser", fan(angles))], RANGE_MAX)
        self._rest = Stillness(self._rays.body, self._rays.others)
        self._ranges: np.ndarray = np.full(COUNT, np.inf)
        self._rng = rng
        self._seq = 0

    def measure(self, data: mujoco.MjData, stamp: float) -> Scan:
        if not self._rest.holds(data):
            self._ranges = self._rays.cast(data)
        ranges = self._ranges
        if self._rng is not None:
            ranges = add_noise(ranges, self._rng, sigma=NOISE, resolution=RESOLUTION)
        self._seq += 1
        return Scan(self._seq, stamp, tuple(np.where(np.isfinite(ranges), ranges, 0.0).tolist()))
