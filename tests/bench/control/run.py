"""One robot, one task, one strategy, one seed: what came of it."""

from __future__ import annotations

import math
import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from control.pilots import PERIOD, STANDING, ByOdometry, ByTheClock, Velocity
from control.tasks import TASKS
from control.vehicles import VEHICLES, Vehicle

from telepresence.safety import Command, Odometry, VelocityGate

LINK_DELAY = (0.02, 0.12)
"""Range of the time from the pilot to the robot, drawn for every command [s]."""
PATIENCE = 3.0
"""A trial ends after so many times its shortest time, plus 10 s."""
AFTERWARDS = 1.0
"""The robot comes to rest [s]."""


@dataclass(frozen=True)
class Strategy:
    """How a path is driven: by odometry or by the clock, through the safety gate or not."""

    name: str
    feedback: bool
    gate: bool


STRATEGIES = {
    strategy.name: strategy
    for strategy in (
        Strategy("open loop", False, False),
        Strategy("open loop, gate", False, True),
        Strategy("odometry", True, False),
        Strategy("odometry, gate", True, True),
    )
}


@dataclass(frozen=True)
class Job:
    """What to run; the same job gives the same trial."""

    vehicle: str
    task: str
    strategy: str
    seed: int


@dataclass
class Trial:
    """What came of a job.

    Args:
        job: Which.
        success: It ended near enough, on its feet, and touched nothing.
        time: From the first command to the last [s].
        error: Of the task [m].
        work: Of the drives [J].
        slip: [m].
        contacts: With anything but the ground.
        impact: Fastest of them [m/s].
        fell: Whether.
        track: True x, y from the start, along its heading [m], every 0.2 s.
    """

    job: Job
    success: bool
    time: float
    error: float
    work: float
    slip: float
    contacts: int
    impact: float
    fell: bool
    track: list[tuple[float, float]] = field(default_factory=list)


def jobs(vehicle: str, seeds: Sequence[int], tasks: Sequence[str] = tuple(TASKS)) -> list[Job]:
    """All trials of one robot; strategies with a gate only for robots that the gate knows."""
    fitting = [s for s in STRATEGIES.values() if VEHICLES[vehicle].profile is not None or not s.gate]
    return [Job(vehicle, task, strategy.name, seed) for task in tasks for strategy in fitting for seed in seeds]


def in_parallel(work: Callable, given: Sequence) -> Iterator:
    """`work` for every item, on all processors, in order."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(os.cpu_count(), mp_context=context) as pool:
        yield from pool.map(work, given, chunksize=4)


def run_job(job: Job) -> Trial:
    """Drive once."""
    task, kind = TASKS[job.task], VEHICLES[job.vehicle]
    # Start and link are the same for every strategy and robot.
    rng = np.random.default_rng([job.seed, *job.task.encode()])
    vehicle = kind(task.scene, task.scattered(kind.front, rng), job.seed)
    try:
        vehicle.step(0.5)
        return _drive(job, vehicle, rng)
    finally:
        vehicle.close()


def _drive(job: Job, vehicle: Vehicle, rng: np.random.Generator) -> Trial:
    task, strategy = TASKS[job.task], STRATEGIES[job.strategy]
    pilot = (ByOdometry if strategy.feedback else ByTheClock)(task.path, vehicle.speed, vehicle.turn)
    gate = VelocityGate(vehicle.profile) if strategy.gate else None
    shortest = sum(leg.distance / vehicle.speed + abs(leg.turn) / vehicle.turn for leg in task.path)
    limit = 10.0 + PATIENCE * shortest
    start, origin = vehicle.truth(), vehicle.odometry()
    vehicle.work = vehicle.slip = 0.0
    link: deque[tuple[float, Velocity, float]] = deque()
    arrived = Command(0.0, 0.0, 0.0, 0.0)
    track, ended, now = [], math.inf, 0.0
    for tick in range(round((limit + AFTERWARDS) / PERIOD)):
        now = tick * PERIOD
        wanted = pilot.decide(now, _relative(vehicle.odometry(), origin)) if now < min(ended, limit) else None
        if wanted is None and ended == math.inf:
            ended = now
        if now > ended + AFTERWARDS or vehicle.fell:
            break
        link.append((now + rng.uniform(*LINK_DELAY), wanted or STANDING, now))
        while link and link[0][0] <= now:
            _, velocity, stamp = link.popleft()
            arrived = Command(*velocity, stamp)
        vehicle.command(*_let_through(gate, vehicle, arrived, now))
        vehicle.step(PERIOD)
        if tick % round(0.2 / PERIOD) == 0:
            x, y, _ = _relative(vehicle.truth(), start)
            track.append((round(x, 4), round(y, 4)))
    error = task.error(start, vehicle.truth(), vehicle)
    return Trial(
        job,
        success=error < task.good and not vehicle.fell and not vehicle.contacts,
        time=min(ended, now),
        error=error,
        work=vehicle.work,
        slip=vehicle.slip,
        contacts=vehicle.contacts,
        impact=vehicle.impact,
        fell=vehicle.fell,
        track=track,
    )


def _let_through(gate: VelocityGate | None, vehicle: Vehicle, command: Command, now: float) -> Velocity:
    if gate is None:
        return command.vx, command.vy, command.wz
    vehicle.report(gate, now)
    decision = gate.step(now, command, Odometry(*vehicle.odometry(), now))
    return decision.vx, decision.vy, decision.wz


def _relative(pose: tuple[float, float, float], origin: tuple[float, float, float]) -> tuple[float, float, float]:
    """`pose` as seen from `origin`."""
    dx, dy = pose[0] - origin[0], pose[1] - origin[1]
    c, s = math.cos(origin[2]), math.sin(origin[2])
    return c * dx + s * dy, c * dy - s * dx, math.remainder(pose[2] - origin[2], math.tau)
