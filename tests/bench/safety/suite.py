"""What the safety benchmark runs: robots, gates, speeds, exposure; in as many processes as there are cores."""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from safety.faults import FAULTS, NO_FAULT
from safety.gates import BubbleGate, NoGate, OurGate, UniformScaling
from safety.robots import INFRARED_ROBOT, LASER_ROBOT, MEASURED_ROBOT, PEPPER_ROBOT, BenchRobot
from safety.run import Outcome, run

REPORT_SEEDS = {"infrared": 9001, "measured": 9004, "laser": 9002, "pepper": 9003}
"""Seeds of the published figures. Whoever tunes takes others: 1 to 99."""
ROBOTS = {"infrared": INFRARED_ROBOT, "measured": MEASURED_ROBOT, "laser": LASER_ROBOT, "pepper": PEPPER_ROBOT}
BATCH = 25
"""Places that are stepped together. Pilots and noise of a place depend on it."""
SECONDS = 30.0
"""Length of a scenario: 300 commands."""
FULL, SOME = 350, 100
"""Scenarios behind a claim, and behind a figure that is only compared with."""

GATES: dict[str, Callable] = {}


def _bubble(robot: BenchRobot, count: int, gap: float) -> BubbleGate:
    return BubbleGate(robot, count, robot.profile.outline.outer_radius + gap)


GATES |= {
    "no gate": NoGate,
    "bubble, gap 0.10": partial(_bubble, gap=0.10),
    "bubble, gap 0.20": partial(_bubble, gap=0.20),
    "uniform scaling": UniformScaling,
    "gate": OurGate,
    "gate, careful": partial(OurGate, careful=True),
}


@dataclass(frozen=True)
class Cell:
    """One robot behind one gate at one speed.

    Args:
        robot, gate: Keys of `ROBOTS` and `GATES`.
        speed: The pilot's [m/s].
        first, count: Scenarios.
        fault: Name of a fault; empty for none.
    """

    robot: str
    gate: str
    speed: float
    first: int
    count: int
    seconds: float = SECONDS
    fault: str = ""

    def batches(self) -> list[Cell]:
        """The same, cut into batches."""
        end = self.first + self.count
        return [
            Cell(self.robot, self.gate, self.speed, first, min(BATCH, end - first), self.seconds, self.fault)
            for first in range(self.first, end, BATCH)
        ]

    def run(self, seed: int | None = None) -> Outcome:
        """Drive it.

        Args:
            seed: The report's by default.
        """
        fault = next((kind() for kind in FAULTS if kind.name == self.fault), NO_FAULT)
        return run(
            ROBOTS[self.robot], GATES[self.gate], seed=REPORT_SEEDS[self.robot] if seed is None else seed,
            first=self.first, count=self.count, speed=self.speed, seconds=self.seconds, fault=fault,
        )  # fmt: skip


def cells(share: float = 1.0) -> list[Cell]:
    """The whole benchmark, or a share of its scenarios."""

    def number(scenarios: int) -> int:
        return max(BATCH, round(scenarios * share / BATCH) * BATCH)

    full, half, some = number(FULL), number(FULL // 2), number(SOME)
    plan = [Cell("infrared", gate, 0.20, 0, full) for gate in GATES]
    plan += [Cell("measured", gate, 0.20, 0, full if gate.startswith("gate") else some) for gate in GATES]
    for robot in ("laser", "pepper"):
        plan += [Cell(robot, "gate", 0.35, 0, half), Cell(robot, "gate", 0.20, half, half)]
        plan += [Cell(robot, gate, 0.35, 0, some) for gate in GATES if not gate.startswith("gate")]
    plan.append(Cell("laser", "gate", 0.50, 2 * half, some))
    plan += [Cell("infrared", "gate", 0.20, full, BATCH, 16.0, kind.name) for kind in FAULTS]
    return plan


def run_all(plan: Sequence[Cell], seed: int | None = None) -> dict[Cell, list[Outcome]]:
    """Drive every cell; shows how far it is. Outcomes of a cell's batches are in order.

    Args:
        seed: Instead of the report's.
    """
    jobs = [(cell, batch, seed) for cell in plan for batch in cell.batches()]
    results: dict[Cell, list[tuple[int, Outcome]]] = {cell: [] for cell in plan}
    for done, (cell, batch, outcome) in enumerate(in_parallel(_job, jobs), 1):
        results[cell].append((batch.first, outcome))
        _progress(done, len(jobs))
    for found in results.values():
        found.sort(key=lambda pair: pair[0])
    return {cell: [outcome for _, outcome in found] for cell, found in results.items()}


def _job(job: tuple[Cell, Cell, int | None]) -> tuple[Cell, Cell, Outcome]:
    cell, batch, seed = job
    return cell, batch, batch.run(seed)


def in_parallel(work: Callable, jobs: Sequence) -> Iterator:
    """Results of a picklable function, as they come. One numpy thread per process: more get in each other's way."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with multiprocessing.get_context("spawn").Pool(os.cpu_count()) as pool:
        yield from pool.imap_unordered(work, jobs)


def _progress(done: int, of: int) -> None:
    if sys.stderr.isatty():
        print(f"\r  {100 * done // of} % of the scenarios", end="\n" if done == of else "", file=sys.stderr, flush=True)
    elif done == of or 10 * done // of != 10 * (done - 1) // of:
        print(f"  {100 * done // of} % of the scenarios", file=sys.stderr, flush=True)
