"""Robots in one world: how many at real time on one core, what one more costs, and where the time goes.

Worlds of every size are stepped in turns by one process, unpaced, with all sensors of all robots on. All robots turn on
the spot: a distance sensor measures nothing anew while everything stands. Costs are processor time for one simulated
second, and each size is compared with the single robot of the same turn: what else runs on the machine slows both down
alike. Then a fleet runs paced behind its wires, with a client per robot that drives and reads it 20 times a second.
"""

from __future__ import annotations

import contextlib
import json
import statistics
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator, Sequence
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
TURN = 0.25
"""Simulated time that a world is stepped before the next one has its turn [s]."""
TICKS = round(TURN / TICK)
SPIN = 0.3
"""[rad/s]"""
COMMAND_TICKS = round(0.05 / TICK)
"""Ticks between two commands of a driver."""
TURNS, TURNS_ALONE = 16, 4
"""The median of so many counts; fewer for a world that is compared with none."""
LARGEST = 48
"""No more are tried."""
PACED = 8
PACED_SECONDS = 8.0
POLL_PERIOD = 0.05


def run() -> list[Row]:
    rows: list[Row] = []
    for kind in KINDS:
        costs = measure(kind, COUNTS)
        one, last = costs[1], costs[COUNTS[-1]]
        for count in COUNTS[1:]:
            name = f"{kind}: processor time per robot and second, {count} in one world"
            rows.append(Row(name, 1e3 * costs[count]["all"] / count, 1e3 * one["all"], "ms", "one robot"))
        rows.append(_growth(kind, {count: cost["all"] for count, cost in costs.items()}))
        for part, name in PARTS.items():
            share = last[part] / COUNTS[-1]
            name = f"{kind}: of which {name}, {COUNTS[-1]} robots"
            rows.append(Row(name, 1e3 * share, 1e3 * one[part], "ms", "one robot"))
        most = largest(kind, costs)
        rows.append(Row(f"{kind}s in one world at real time, one core", most, 1.0, "robots", "one robot"))
    rows.append(picture())
    return [*rows, *paced()]


def _growth(kind: str, cost: dict[int, float]) -> Row:
    """What one more robot costs in a large world against a smaller one: the same, if the cost grows linearly."""
    middle, last = COUNTS[-2], COUNTS[-1]
    late = (cost[last] - cost[middle]) / (last - middle)
    early = (cost[middle] - cost[1]) / (middle - 1)
    name = f"{kind}: what one more robot costs, from {middle} to {last}"
    return Row(name, 1e3 * late, 1e3 * early, "ms", f"from 1 to {middle}")


def measure(what: str, counts: Sequence[int]) -> dict[int, dict[str, float]]:
    """Processor seconds for a simulated second with so many robots of the kind `what`: "all", and its parts "physics",
    "rays", "rest". For what = "picture": "all" of one picture."""
    answer = subprocess.run(
        [sys.executable, __file__, what, *map(str, counts)], capture_output=True, text=True, check=True, timeout=600
    )
    return {int(count): cost for count, cost in json.loads(answer.stdout.splitlines()[-1]).items()}


def largest(kind: str, costs: dict[int, dict[str, float]]) -> int:
    """The largest fleet that needs no more than a second for a second, to a sixteenth: bisected between worlds. If
    the hall is full before, as many as it holds."""
    good = max((count for count, cost in costs.items() if cost["all"] <= 1.0), default=0)
    bad = min((count for count, cost in costs.items() if cost["all"] > 1.0), default=_room(kind) + 1)
    while bad - good > max(1, good // 16):
        middle = (good + bad) // 2
        if measure(kind, [middle])[middle]["all"] <= 1.0:
            good = middle
        else:
            bad = middle
    return good


def _room(kind: str) -> int:
    """How many robots of that kind the hall holds, up to LARGEST."""
    places, spawn = FreePlaces(SCENE), find_kind(kind)("x/").model.spawn
    for count in range(LARGEST):
        try:
            places.find(spawn)
        except ValueError:
            return count
    return LARGEST


def picture() -> Row:
    """A robot's picture in a full hall against one in an empty hall."""
    costs = measure("picture", (1, PACED))
    many, one = costs[PACED]["all"], costs[1]["all"]
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
        for path, body in (("/data/omnidrive", b"[0.0,0.0,%g]" % SPIN), ("/data/distancesensorarray", None)):
            with urllib.request.urlopen(urllib.request.Request(url + path, body), timeout=5.0) as answer:
                answers += answer.status == 200
        due += POLL_PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
    return answers


# --- the process that is measured ------------------------------------------------------------------------------------


class Measured:
    """A world, and what its turns have cost so far: processor seconds for a simulated second, turn by turn."""

    def __init__(self, kind: str, count: int) -> None:
        self.world, self._robots = _world(kind, count)
        self._step()
        self.turns: dict[str, list[float]] = {"all": [], "physics": [], "rays": []}

    def _step(self) -> None:
        for _ in range(TICKS // COMMAND_TICKS):
            for robot in self._robots:
                robot.robot.set_velocity(0.0, 0.0, SPIN)
            self.world.step(COMMAND_TICKS)

    def take_turn(self) -> None:
        self.turns["all"].append(_timed(self._step) / TURN)
        with _counted_casts() as spent:
            self._step()
        self.turns["rays"].append(sum(spent) / TURN)
        with self.world.locked() as data:
            cost = _timed(lambda: mujoco.mj_step(self.world.model, data, nstep=TICKS * STEPS_PER_TICK))
        self.turns["physics"].append(cost / TURN)

    def cost(self, first: Measured) -> dict[str, float]:
        """Return the cost by comparison with the first world, turn by turn."""
        found = {}
        for part, turns in self.turns.items():
            beside = first.turns[part]
            ratio = statistics.median(a / b for a, b in zip(turns, beside, strict=True))
            found[part] = ratio * statistics.median(beside)
        found["rest"] = max(0.0, found["all"] - found["physics"] - found["rays"])
        return found

    def close(self) -> None:
        _close(self.world, self._robots)


def _measure_here(kind: str, counts: Sequence[int]) -> dict[int, dict[str, float]]:
    worlds = [Measured(kind, count) for count in counts]
    for _ in range(TURNS if len(worlds) > 1 else TURNS_ALONE):
        for world in worlds:
            world.take_turn()
    costs = {count: world.cost(worlds[0]) for count, world in zip(counts, worlds, strict=True)}
    for world in worlds:
        world.close()
    return costs


@contextlib.contextmanager
def _counted_casts() -> Iterator[list[float]]:
    """The processor time of every cast of rays meanwhile [s]."""
    spent: list[float] = []
    cast = rays.Rays.cast

    def timed(bundles, data):
        start = time.thread_time()
        try:
            return cast(bundles, data)
        finally:
            spent.append(time.thread_time() - start)

    rays.Rays.cast = timed
    try:
        yield spent
    finally:
        rays.Rays.cast = cast


def _timed(work: Callable[[], object]) -> float:
    """Processor time [s]."""
    begin = time.thread_time()
    work()
    return time.thread_time() - begin


def _pictures_here(counts: Sequence[int]) -> dict[int, dict[str, float]]:
    return {count: {"all": _picture_here(count)} for count in counts}


def _picture_here(count: int) -> float:
    world, robots = _world("robotino", count)
    painter = Painter(world)
    camera = world.model.camera("robotino_1/camera").id
    costs = []
    for _ in range(43):
        for robot in robots:
            robot.robot.set_velocity(0.0, 0.0, SPIN)
        world.step(COMMAND_TICKS)  # a picture in which nothing has moved is not painted
        # OpenGL draws on threads of its own.
        begin = time.process_time()
        painter.snapshot()
        painter.draw(camera, 640, 480, "rgb")
        costs.append(time.process_time() - begin)
    painter.close()
    _close(world, robots)
    return statistics.median(costs[3:])


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
    what, numbers = sys.argv[1], [int(word) for word in sys.argv[2:]]
    print(json.dumps(_pictures_here(numbers) if what == "picture" else _measure_here(what, numbers)))
