"""A walker that tests move step by step, on ground that differs from seed to seed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pytest

from telepresence.sim.scene import build_world
from telepresence.sim.walker.body import walker_model
from telepresence.sim.walker.robot import Walker
from telepresence.sim.world import TICK, World


@dataclass
class Stepped:
    """A walker in a world that advances only on request."""

    world: World
    walker: Walker

    def wait(self, seconds: float) -> None:
        self.world.step(round(seconds / TICK))

    def walk(self, vx: float, vy: float, wz: float, seconds: float) -> None:
        """Command a velocity every 0.1 s, as programs do."""
        for _ in range(round(seconds / 0.1)):
            self.walker.set_velocity(vx, vy, wz)
            self.wait(0.1)

    def ahead(self, start: tuple[float, ...]) -> float:
        """How far the walker has come along the heading it had at `start`, a `truth` [m]."""
        x, y = self.walker.truth()[:2]
        return (x - start[0]) * math.cos(start[5]) + (y - start[1]) * math.sin(start[5])

    def setpoints(self) -> np.ndarray:
        """Return the setpoints of the joints' servos [rad]."""
        with self.world.locked() as data:
            return data.ctrl.copy()

    def scatter(self, seed: int) -> None:
        """Another start: pose, joint angles, and what the ground is like there."""
        rng = np.random.default_rng(seed)
        model = self.world.model
        lift = 0.0
        if model.nhfield:
            lift = float(model.hfield_size[0][2])  # no foot may start inside a hill
            rows, columns = int(model.hfield_nrow[0]), int(model.hfield_ncol[0])
            ground = model.hfield_data.reshape(rows, columns)
            ground[:] = np.roll(ground, rng.integers(0, (rows, columns)), (0, 1))
        root = model.joint("walker/root")
        with self.world.locked() as data:
            place = root.qposadr[0]
            data.qpos[place : place + 2] += rng.uniform(-0.2, 0.2, 2)
            data.qpos[place + 2] += lift
            yaw = rng.uniform(-0.5, 0.5)
            data.qpos[place + 3 : place + 7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
            data.qpos[place + 7 :] += rng.normal(0.0, 0.03, 12)
            mujoco.mj_forward(model, data)
        self.wait(0.5)


@pytest.fixture
def stepped() -> Iterator[Callable[..., Stepped]]:
    """Build a stepped walker: `stepped(scene, seed=0, **options of Walker)`."""
    worlds = []

    def build(scene: str = "flat", seed: int = 0, **options: Any) -> Stepped:
        world = build_world(scene, [walker_model()], seed)
        worlds.append(world)
        made = Stepped(world, Walker(world, None, seed=seed, **options))
        made.wait(0.5)
        return made

    yield build
    for world in worlds:
        world.close()
