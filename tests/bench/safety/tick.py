"""What one tick of the gate costs in a crowded place: as many obstacles remembered as it keeps, a laser's 72 beams."""

from __future__ import annotations

import math
import time

import numpy as np
from safety.robots import TICK, BenchRobot, measure
from safety.worlds import THICK, Batch, Place

from telepresence.safety import Command, Odometry, VelocityGate

POLES = 60
WARM_UP = 100
"""Ticks that are not counted: memory fills, numpy loads."""


def tick_times(robot: BenchRobot, ticks: int, seed: int) -> np.ndarray:
    """Processor time of every tick, scans taken in included, while the robot wanders between poles (ticks,) [s].

    Processor time, because on a busy machine the clock on the wall measures the other programs too.
    """
    rng = np.random.default_rng([seed, 31])
    place = Place(width=6.0, depth=6.0)
    for bearing in np.linspace(0.0, math.tau, POLES, endpoint=False):
        distance = rng.uniform(0.75, 1.4)
        place.circles.append((distance * math.cos(bearing), distance * math.sin(bearing), 0.02, THICK))
    place.segments.append((-3.0, -3.0, 3.0, -3.0, 0))
    batch = Batch([place], seed)
    gate = VelocityGate(robot.profile)
    pose, times = np.zeros(3), []
    for tick in range(WARM_UP + ticks):
        now = tick * TICK
        readings = [
            (source.name, measure(source, batch, pose[None], rng)[0])
            for source in robot.profile.sources
            if tick % robot.every[source.name] == 0
        ]
        command = Command(0.3 * math.cos(0.3 * now), 0.3 * math.sin(0.3 * now), 0.4, now)
        odometry = Odometry(*pose.tolist(), now)
        begin = time.thread_time()
        for name, ranges in readings:
            gate.update_ranges(name, now, ranges)
        decision = gate.step(now, command, odometry)
        times.append(time.thread_time() - begin)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        pose += TICK * np.array([c * decision.vx - s * decision.vy, s * decision.vx + c * decision.vy, decision.wz])
    return np.array(times[WARM_UP:])
