"""A key pressed in the keyboard program's terminal until ALMotion's setpoint, against bare rospy hops."""

from __future__ import annotations

import os
import pty
import queue
import random
import sys
import time
from collections.abc import Sequence
from subprocess import DEVNULL

from report import Row, percentile
from ros_graph import hop_times, private_master, wait_for

from pepper_sim.simulation import Simulation
from telepresence.sim.command_line import SWITCH_INTERVAL
from telepresence.station import processes

PRESSES = 120
HOPS_ALLOWED = 4


def run() -> list[Row]:
    with private_master() as environment:
        hops = hop_times(environment)
        delays = key_to_setpoint(environment)
    name = f"{HOPS_ALLOWED} bare rospy hops"
    return [
        Row(
            "key to setpoint, p50", percentile(delays, 50) * 1e3, HOPS_ALLOWED * percentile(hops, 50) * 1e3, "ms", name
        ),
        Row(
            "key to setpoint, p99", percentile(delays, 99) * 1e3, HOPS_ALLOWED * percentile(hops, 99) * 1e3, "ms", name
        ),
    ]


def key_to_setpoint(environment: dict[str, str]) -> list[float]:
    """Seconds from writing the key to the terminal to the call of the robot's `set_velocity`, one per press."""
    sys.setswitchinterval(SWITCH_INTERVAL)  # as the simulated robot's own program does
    with Simulation(port=0) as simulation:
        return drive_by_keyboard(simulation, environment)


def drive_by_keyboard(
    simulation: Simulation, environment: dict[str, str], before: Sequence[str] = (), presses: int = PRESSES
) -> list[float]:
    """Do so with a simulation that runs; `before` are words before each command line."""
    setpoints: queue.SimpleQueue[tuple[float, float]] = queue.SimpleQueue()
    drive = simulation.robot.set_velocity

    def record(vx: float, vy: float, wz: float) -> None:
        setpoints.put((time.monotonic(), vx))
        drive(vx, vy, wz)

    simulation.robot.set_velocity = record
    port = simulation.url.rpartition(":")[2]
    driver = processes.start(
        [*before, "roslaunch", "naoqi_driver_py", "naoqi_driver.launch", "nao_ip:=127.0.0.1", f"nao_port:={port}"],
        env=environment,
        stdin=DEVNULL,
        stdout=DEVNULL,
        stderr=DEVNULL,
    )
    terminal, inner = pty.openpty()
    keyboard = processes.start(
        [*before, "rosrun", "teleop_twist_keyboard", "teleop_twist_keyboard.py"],
        env=environment,
        stdin=inner,
        stdout=DEVNULL,
        stderr=DEVNULL,
    )
    try:
        return [press(terminal, key, sign, setpoints) for key, sign in keys(terminal, setpoints, presses)]
    finally:
        processes.end(keyboard)
        processes.end(driver)
        simulation.robot.set_velocity = drive
        os.close(terminal)
        os.close(inner)


def keys(terminal: int, setpoints: queue.SimpleQueue, presses: int):
    """Forward and backward in turn, at irregular times; first until the whole way is open."""

    def open_way() -> bool:
        os.write(terminal, b"i")
        time.sleep(0.3)
        return not setpoints.empty()

    wait_for(open_way, "the first setpoint")
    random.seed(1)
    for count in range(presses):
        time.sleep(random.uniform(0.15, 0.35))
        yield (b",", -1) if count % 2 == 0 else (b"i", 1)


def press(terminal: int, key: bytes, sign: int, setpoints: queue.SimpleQueue) -> float:
    begin = time.monotonic()
    os.write(terminal, key)
    while True:
        try:
            when, vx = setpoints.get(timeout=5.0)
        except queue.Empty:
            raise RuntimeError(f"key {key!r} did not reach the robot within 5 s") from None
        if when > begin and vx * sign > 0:
            return when - begin
