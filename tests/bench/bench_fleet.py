"""Robots in one world: how many at real time on one core, what one more costs, and where the time goes.

Every world is stepped unpaced with all sensors of all robots on, in a process of its own; costs are processor time for
one simulated second, so that other work on the machine counts little. Then a fleet runs paced behind its wires, with a
client per robot that drives and reads it 20 times a second.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor

import mujoco
from report import Row

from telepresence.sim import rays
from telepresence.sim.painter import Painter
from telepresence.sim.placement import FreePlaces
from telepresence.sim.scene import build_world
from telepresence.sim.simulated_robot import SimulatedRobot, find_kind
from telepresence.sim.simulation import Simulation, parse_robots
from telepresence.sim.world import STEPS_PER_TICK, TICK, World

KINDS = ("robotino", "pepper")
COUNTS = (1, 2, 4, 8, 16)
PARTS = {"physics": "bare mj_step", "rays": "distance sensors", "rest": "controllers and odometry"}
SCENE = "flat"
SECONDS = 2.0
"""Simulated time per measurement [s]."""
ROUNDS = 3
"""The least of so many counts: whatever else ran, on the caches too, only adds."""
LARGEST = 48
"""As many robots as the hall holds."""
PACED = 8
PACED_SECONDS = 8.0
POLL_PERIOD = 0.05


def run() -> list[Row]:
    rows: list[Row] = []
    for kind in KINDS:
        costs = {count: measure(kind, count) for count in COUNTS}
        first, last = COUNTS[0], COUNTS[-1]
        for count in COUNTS[1:]:
            rows.append(
                Row(
                    f"{kind}: processor time per robot and second, {count} in one world",
                    1e3 * costs[count]["all"] / count,
                    1e3 * costs[first]["all"],
                    "ms",
                    "one robot",
                )
            )
        each = costs[last]["all"] / last
        for part, name in PARTS.items():
            share = costs[last][part] / last
            rows.append(Row(f"{kind}: of which {name}, {last} robots", 1e3 * share, 1e3 * each, "ms", "all of it"))
        most = largest(kind, costs)
        rows.append(Row(f"{kind}s in one world at real time, one core", most, 1.0, "robots", "one robot"))
    rows.append(picture())
    return [*rows, *paced()]


def measure(what: str, count: int) -> dict[str, float]:
    """Processor seconds for a simulated second with `count` robots of the kind `what`: "all", and its parts "physics",
    "rays", "rest". For what = "picture": "all" of one picture."""
    answer = subprocess.run(
        [sys.executable, __file__, what, str(count)], capture_output=True, text=True, check=True, timeout=300
    )
    return json.loads(answer.stdout.splitlines()[-1])


def largest(kind: str, costs: dict[int, dict[str, float]]) -> int:
    """The largest fleet that needs no more than a second for a second, to a sixteenth: bisected between worlds."""
    good = max((count for count, cost in costs.items() if cost["all"] <= 1.0), default=0)
    bad = min((count for count, cost in costs.items() if cost["all"] > 1.0), default=LARGEST + 1)
    while bad - good > max(1, good // 16):
        middle = (good + bad) // 2
        if measure(kind, middle)["all"] <= 1.0:
            good = middle
        else:
            bad = middle
    return good


def picture() -> Row:
    """A robot's picture in a full hall against one in an empty hall."""
    many, one = (measure("picture", count)["all"] for count in (PACED, 1))
    return Row(f"a picture 640x480 among {PACED} robots", 1e3 * many, 1e3 * one, "ms", "of the only robot")


def paced() -> list[Row]:
    """Behind their wires, in real time."""
    with Simulation(parse_robots([f"robotino*{PACED}"]), SCENE) as simulation, ThreadPoolExecutor(PACED) as pool:
        end = time.monotonic() + 1.0 + PACED_SECONDS
        clients = [pool.submit(drive, url, end) for url in simulation.urls]
        time.sleep(1.0)
        cpu, simulated, wall = time.process_time(), simulation.world.time, time.monotonic()
        time.sleep(PACED_SECONDS - 0.5)
        cpu = time.process_time() - cpu
        factor = (simulation.world.time - simulated) / (time.monotonic() - wall)
        wall = time.monotonic() - wall
        answers = sum(client.result() for client in clients)
        asked = PACED * (1.0 + PACED_SECONDS) / POLL_PERIOD * 2
    return [
        Row(f"real-time factor, {PACED} robotinos driven and read over REST", factor, 1.0, "", "the clock"),
        Row("processor, clients included", cpu / wall, 1.0, "cores", "one core"),
        Row("requests answered", answers, asked, "", "asked for"),
    ]


def drive(url: str, end: float) -> int:
    """Turn on the spot and read the distances until `end`; the number of answers."""
    answers, due = 0, time.monotonic()
    while time.monotonic() < end:
        for path, body in (("/data/omnidrive", b"[0.0,0.0,0.3]"), ("/data/distancesensorarray", None)):
            with urllib.request.urlopen(urllib.request.Request(url + path, body), timeout=5.0) as answer:
                answers += answer.status == 200
        due += POLL_PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
    return answers


# --- the process that is measured ------------------------------------------------------------------------------------


def _measure_here(kind: str, count: int) -> dict[str, float]:
    world, robots = _world(kind, count)
    ticks = round(SECONDS / TICK)
    world.step(ticks // 10)
    everything = min(_timed(world, ticks) for _ in range(ROUNDS)) / SECONDS
    # The same again with the clock around every cast; the clock itself is taken off by measuring the whole without it.
    spent, shoot = 0.0, rays.RayBundle._shoot

    def timed(bundle, data, normals):
        nonlocal spent
        start = time.process_time()
        try:
            return shoot(bundle, data, normals)
        finally:
            spent += time.process_time() - start

    rays.RayBundle._shoot = timed
    world.step(ticks)
    rays.RayBundle._shoot = shoot
    with world.locked() as data:
        begin = time.process_time()
        mujoco.mj_step(world.model, data, nstep=ticks * STEPS_PER_TICK)
        physics = (time.process_time() - begin) / SECONDS
    _close(world, robots)
    casts = spent / SECONDS
    return {"all": everything, "physics": physics, "rays": casts, "rest": max(0.0, everything - physics - casts)}


def _timed(world: World, ticks: int) -> float:
    """Processor time of so many ticks [s]."""
    begin = time.process_time()
    world.step(ticks)
    return time.process_time() - begin


def _picture_here(count: int) -> dict[str, float]:
    world, robots = _world("robotino", count)
    painter = Painter(world)
    camera = world.model.camera("robotino_1/camera").id
    for _ in range(3):
        painter.look()
        painter.draw(camera, 640, 480, "rgb")
    rounds, begin = 40, time.process_time()
    for _ in range(rounds):
        painter.look()
        painter.draw(camera, 640, 480, "rgb")
    spent = (time.process_time() - begin) / rounds
    painter.close()
    _close(world, robots)
    return {"all": spent}


def _world(kind: str, count: int) -> tuple[World, list[SimulatedRobot]]:
    places = FreePlaces(SCENE)
    make = find_kind(kind)
    robots = [make(f"{kind}_{i + 1}/", places.find(make("x/").model.spawn)) for i in range(count)]
    world = build_world(SCENE, [robot.model for robot in robots])
    for robot in robots:
        robot.enter(world, _Blind(), 0)
    return world, robots


def _close(world: World, robots: list[SimulatedRobot]) -> None:
    for robot in robots:
        robot.close()
    world.close()


class _Blind:
    """Cameras that nobody asks for a picture."""

    def set_texture(self, *_: object) -> None:
        """A tablet that nobody sees."""


if __name__ == "__main__":
    what, number = sys.argv[1], int(sys.argv[2])
    print(json.dumps(_picture_here(number) if what == "picture" else _measure_here(what, number)))
