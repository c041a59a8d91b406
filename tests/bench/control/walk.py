"""Does the walker walk a metre, and does it stand still on command? Many starts, each on another piece of ground."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from control.vehicles import VEHICLES

from telepresence.sim.walker.gait import GAITS

FAR_ENOUGH = 1.0
"""[m]"""
SETTLING = 0.5
"""Time after the command to freeze before standing still counts [s]."""
HELD = 3.0
"""[s]"""
SCENES = {"flat": (-0.5, 0.0), "rough": (-0.4, 0.2)}
"""Middle of the starts (x, y) [m]."""


@dataclass(frozen=True)
class WalkJob:
    """`direction` is 1 or -1."""

    vehicle: str
    scene: str
    direction: int
    seed: int


@dataclass(frozen=True)
class Walk:
    """Distance along the first heading [m], how far it went on after the command to freeze and drifted later [m]."""

    job: WalkJob
    distance: float
    coast: float
    drift: float
    fell: bool

    @property
    def success(self) -> bool:
        return self.distance >= FAR_ENOUGH and not self.fell


def walk_jobs(seeds: Sequence[int]) -> list[WalkJob]:
    return [
        WalkJob(gait, scene, direction, seed)
        for gait in GAITS
        for scene in SCENES
        for direction in (1, -1)
        for seed in seeds
    ]


def run_walk(job: WalkJob) -> Walk:
    """Start somewhere near, walk for the time that 1.2 m take, freeze. Pose, joints, noise and ground by the seed."""
    rng = np.random.default_rng([job.seed, 2])
    x, y = SCENES[job.scene] + rng.uniform(-0.3, 0.3, 2)
    vehicle = VEHICLES[job.vehicle](job.scene, (float(x), float(y), float(rng.uniform(-0.5, 0.5))), job.seed)
    try:
        with vehicle.world.locked() as data:
            data.qpos[-12:] += rng.normal(0.0, 0.03, 12)
        vehicle.robot.hold_heading = True
        vehicle.step(0.5)
        start = vehicle.truth()
        vehicle.robot.move(job.direction)
        vehicle.step(1.2 / GAITS[vehicle.gait].cruise)
        told = vehicle.robot.truth()
        vehicle.robot.move(0)
        vehicle.step(SETTLING)
        stood = vehicle.robot.truth()
        vehicle.step(HELD)
        end = vehicle.robot.truth()
        ahead = (stood[0] - start[0]) * math.cos(start[2]) + (stood[1] - start[1]) * math.sin(start[2])
        return Walk(
            job,
            distance=job.direction * ahead,
            coast=math.dist(told[:2], stood[:2]),
            drift=math.dist(stood[:3], end[:3]),
            fell=vehicle.fell,
        )
    finally:
        vehicle.close()
