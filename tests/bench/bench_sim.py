"""Physics with everything around it against bare `mj_step` of the same model, and real time against the clock."""

from __future__ import annotations

import statistics
import time

import mujoco
from camera_client import start_viewers
from pepper_sim.simulation import Simulation
from report import Row

ROUNDS = 7
TICKS = 2000  # 10 s of simulated time per round
PACED_SECONDS = 10.0


def run() -> list[Row]:
    return [*unpaced(), *paced()]


def unpaced() -> list[Row]:
    """Alternate between both, and take the median of the pairs: the machine's speed drifts."""
    with Simulation(port=0, start=False) as simulation:
        world = simulation.world
        steps = TICKS * world.steps_per_tick
        data = mujoco.MjData(world.model)
        mujoco.mj_copyData(data, world.model, world.data)
        world.step(200)
        pairs = []
        for _ in range(ROUNDS):
            begin = time.perf_counter()
            for _ in range(steps):
                mujoco.mj_step(world.model, data)
            middle = time.perf_counter()
            world.step(TICKS)
            end = time.perf_counter()
            pairs.append((steps / (end - middle), steps / (middle - begin)))
    ours, bare = sorted(pairs, key=lambda pair: pair[0] / pair[1])[ROUNDS // 2]
    return [Row("steps, unpaced, all sensors on", ours, bare, "1/s", "bare mj_step")]


def paced() -> list[Row]:
    """Two clients, each asking for one camera at 30 pictures/s 640x480 over qi."""
    with Simulation(port=0) as simulation, start_viewers(simulation.server.endpoints[0], cameras=(0, 1)) as viewers:
        viewers.wait_for_first_pictures()
        counts = viewers.counts()
        cpu, simulated, wall = time.process_time(), simulation.world.time, time.monotonic()
        time.sleep(PACED_SECONDS)
        cpu, simulated, wall = (
            time.process_time() - cpu,
            simulation.world.time - simulated,
            time.monotonic() - wall,
        )
        pictures = [after - before for before, after in zip(counts, viewers.counts(), strict=True)]
        dropped = simulation.world.dropped_time
    return [
        Row("real-time factor, two cameras", simulated / wall, 1.0, "", "the clock"),
        Row("time given up to stay in real time", dropped, wall, "s", "the whole run"),
        Row("processor, two cameras", cpu / wall, 1.0, "cores", "one core"),
        Row("pictures/s, mean of two cameras", statistics.mean(pictures) / wall, 30.0, "1/s", "asked for"),
    ]
