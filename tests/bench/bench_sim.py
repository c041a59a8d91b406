"""Physics with everything around it against bare `mj_step` of the same model, and real time against the clock."""

from __future__ import annotations

import statistics
import time

import mujoco
from media.camera_client import Viewers, start_viewers
from report import Row

from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from pepper_sim.simulation import Simulation
from telepresence.sim.scene import build_world
from telepresence.sim.world import STEPS_PER_TICK

ROUNDS = 7
TICKS = 2000  # 10 s of simulated time per round
PACED_SECONDS = 10.0
TURN = 0.5
"""[rad/s]. What a camera or another sensor sees is made anew only when something has moved."""


def run() -> list[Row]:
    return [*unpaced("standing"), *unpaced("turning", TURN), *paced()]


def unpaced(what: str, turn: float = 0.0) -> list[Row]:
    """Alternate between both, and take the median of the pairs: the machine's speed drifts. `turn` [rad/s]"""
    world = build_world("apartment", [pepper_model()])
    robot = Pepper(world, None)
    robot.set_velocity(0.0, 0.0, turn)
    world.step(TICKS // 10)
    data = mujoco.MjData(world.model)
    with world.locked() as live:
        mujoco.mj_copyData(data, world.model, live)  # with the servos' setpoints: it turns, too
    pairs = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        mujoco.mj_step(world.model, data, nstep=TICKS * STEPS_PER_TICK)
        middle = time.perf_counter()
        world.step(TICKS)
        end = time.perf_counter()
        steps = TICKS * STEPS_PER_TICK
        pairs.append((steps / (end - middle), steps / (middle - begin)))
    assert robot.snapshot().time == world.time, "the robot's sensors were not computed"
    world.close()
    ours, bare = sorted(pairs, key=lambda pair: pair[0] / pair[1])[ROUNDS // 2]
    return [Row(f"steps, unpaced, all sensors on, {what}", ours, bare, "1/s", "bare mj_step")]


def paced() -> list[Row]:
    """Two clients, each asking for one camera at 30 pictures/s 640x480 over qi; the robot stands, then it turns."""
    with Simulation(port=0) as simulation, start_viewers(simulation.url, cameras=(0, 1)) as viewers:
        viewers.wait_for_first_pictures()
        standing = watched(simulation, viewers, "standing")
        simulation.robot.set_velocity(0.0, 0.0, TURN)
        return [*standing, *watched(simulation, viewers, "turning")]


def watched(simulation: Simulation, viewers: Viewers, what: str) -> list[Row]:
    counts, dropped = viewers.counts(), simulation.world.dropped_time
    cpu, simulated, wall = time.process_time(), simulation.world.time, time.monotonic()
    time.sleep(PACED_SECONDS)
    cpu, simulated, wall = time.process_time() - cpu, simulation.world.time - simulated, time.monotonic() - wall
    pictures = [after - before for before, after in zip(counts, viewers.counts(), strict=True)]
    return [
        Row(f"real-time factor, two cameras, {what}", simulated / wall, 1.0, "", "the clock"),
        Row(f"time given up, {what}", simulation.world.dropped_time - dropped, wall, "s", "the whole run"),
        Row(f"processor, two cameras, {what}", cpu / wall, 1.0, "cores", "one core"),
        Row(f"pictures/s, mean of two cameras, {what}", statistics.mean(pictures) / wall, 30.0, "1/s", "asked for"),
    ]
