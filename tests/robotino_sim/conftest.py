"""A Robotino that tests drive step by step, and one that answers HTTP in real time."""

from __future__ import annotations

import http.client
import json
import math
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pytest

from robotino_sim.models import robotino_model
from robotino_sim.robot import Robotino
from robotino_sim.simulation import Simulation
from telepresence.sim.scene import build_world
from telepresence.sim.world import TICK, World

ROBOT_GROUP = 3


@dataclass
class Stepped:
    """A robot in a world that advances only on request."""

    world: World
    robot: Robotino

    def place(self, x: float, y: float, yaw: float = 0.0) -> None:
        """Put the robot somewhere, standing [m, m, rad]."""
        with self.world.locked() as data:
            start = self.world.model.joint("robotino/root").qposadr[0]
            data.qpos[start : start + 3] = x, y, 0.0
            data.qpos[start + 3 : start + 7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
            dofs = self.world.model.joint("robotino/root").dofadr[0]
            data.qvel[dofs : dofs + 6] = 0.0
            mujoco.mj_forward(self.world.model, data)

    def wait(self, seconds: float) -> None:
        self.world.step(round(seconds / TICK))

    def drive(self, vx: float, vy: float, wz: float, seconds: float) -> None:
        """Command a velocity every 50 ms, as clients do."""
        for _ in range(round(seconds / 0.05)):
            self.robot.set_velocity(vx, vy, wz)
            self.wait(0.05)

    def velocity(self) -> tuple[float, float, float]:
        """True velocity in the robot's own frame (vx, vy, wz) [m/s, m/s, rad/s]."""
        with self.world.locked() as data:
            start = self.world.model.joint("robotino/root").dofadr[0]
            vx, vy = data.qvel[start : start + 2]
            wz = float(data.qvel[start + 5])
        yaw = self.robot.truth()[5]
        return (
            float(vx * math.cos(yaw) + vy * math.sin(yaw)),
            float(-vx * math.sin(yaw) + vy * math.cos(yaw)),
            wz,
        )

    def ray(self, radius: float, height: float, bearing: float) -> float:
        """True distance [m] from a point of the robot's outline outward; infinity if nothing is there. What is painted
        on things that move does not count."""
        x, y, z, _, _, yaw = self.robot.truth()
        heading = yaw + bearing
        direction = np.array([math.cos(heading), math.sin(heading), 0.0])
        start = np.array([x, y, z + height]) + radius * direction
        model, groups = self.world.model, np.ones(6, np.uint8)
        groups[ROBOT_GROUP] = 0
        painted = (model.geom_contype == 0) & (model.body_weldid[model.geom_bodyid] != 0)
        hit = np.zeros(1, np.int32)
        with self.world.locked() as data:
            usual = model.geom_group.copy()
            model.geom_group[painted] = ROBOT_GROUP
            distance = mujoco.mj_ray(model, data, start, direction, groups, True, -1, hit)
            model.geom_group[:] = usual
        return distance if distance >= 0.0 else math.inf


@pytest.fixture
def stepped() -> Iterator[Callable[..., Stepped]]:
    """Build a stepped robot: `stepped(scene, **options of Robotino)`."""
    worlds = []

    def build(scene: str = "empty", *, seed: int = 0, laser: bool = False, **options: Any) -> Stepped:
        world = build_world(scene, [robotino_model(laser=laser)], seed)
        worlds.append(world)
        return Stepped(world, Robotino(world, None, seed=seed, **options))

    yield build
    for world in worlds:
        world.close()


class Client:
    """What a person writes after reading the vendor's wiki: standard library, a connection per request."""

    def __init__(self, url: str) -> None:
        self.url = url

    def request(
        self, method: str, path: str, body: bytes | None = None, content_type: str | None = None
    ) -> tuple[int, dict[str, str], bytes]:
        """Status, headers with lower-case names, body."""
        headers = {"Content-Type": content_type} if content_type else {}
        request = urllib.request.Request(self.url + path, body, headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=10.0) as answer:
                return answer.status, _lower(answer.headers), answer.read()
        except urllib.error.HTTPError as error:
            return error.code, _lower(error.headers), error.read()

    def get(self, path: str) -> Any:
        """The JSON at `path`."""
        status, headers, body = self.request("GET", path)
        assert (status, headers["content-type"]) == (200, "application/json")
        return json.loads(body)

    def put(self, path: str, value: Any) -> int:
        """Status after putting `value` as JSON."""
        return self.request("PUT", path, json.dumps(value).encode(), "application/json")[0]

    def connection(self) -> http.client.HTTPConnection:
        """A connection that stays open between requests."""
        return http.client.HTTPConnection(self.url.removeprefix("http://"), timeout=10.0)


def _lower(headers: Any) -> dict[str, str]:
    return {name.lower(): value for name, value in headers.items()}


@pytest.fixture(scope="module")
def simulation() -> Iterator[Simulation]:
    """A simulated Robotino in real time on a free port."""
    with Simulation(port=0) as running:
        yield running


@pytest.fixture
def client(simulation: Simulation) -> Client:
    """A client of `simulation`, which starts afresh for every test."""
    simulation.restart()
    return Client(simulation.url)


@pytest.fixture(scope="session", name="make_client")
def _make_client() -> Callable[[str], Client]:
    return Client
