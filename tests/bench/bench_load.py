"""Key to setpoint, rest after silence, age of the picture and start while other programs keep all processors busy, one
each or two each, with and without priorities.

The simulated robot is this process, which nothing delays: a robot has a computer of its own. Without `SCHED_RR` for
whoever runs this the robot waits as well, and "with priorities" is what is allowed instead: it is printed.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial

from bench_startup import time_up
from bench_teleop import drive_by_keyboard
from bench_video import camera_node, watch
from report import Row, percentile
from ros_graph import private_master, wait_for

from pepper_sim.simulation import Simulation
from telepresence.station import priority, processes

CROWD = 2
"""Busy programs for each processor where there are more of them than processors."""
PRESSES = 60
SILENCES = 12
"""Publishers that are killed while the robot turns."""
STARTS = 3
ENOUGH = 10
"""Figures of which a 95th percentile says something."""
TURN, STANDS = 0.5, 0.02
"""[rad/s]; turning, as nothing is in the way."""
PERIOD = 0.005
ORDINARY = ["chrt", "--other", "0"]
"""What starts an ordinary program from this one, which is none."""


def run() -> list[Row]:
    print(f"with priorities: {priority.put_thread_first()}", flush=True)
    rows: list[Row] = []
    quiet: dict[str, list[float]] = {}
    for name, loops, setting in (
        ("quiet", 0, "on"),
        ("busy", 1, "on"),
        ("crowded, without priorities", CROWD, "off"),
        ("crowded", CROWD, "on"),
    ):
        with private_master() as environment, busy_processors(loops):
            found = measure({**environment, priority.OFF: setting})
        quiet = quiet or found
        for what, seconds in found.items():
            rows += [
                Row(f"{what}, {label}, {name}", middle(seconds) * 1e3, middle(quiet[what]) * 1e3, "ms", "quiet")
                for label, middle in spread(len(seconds)).items()
            ]
    return rows


def spread(count: int) -> dict[str, Callable[[list[float]], float]]:
    """What is said of so many figures: of a few the median alone."""
    if count < ENOUGH:
        return {"median": statistics.median}
    return {f"p{share}": partial(percentile, percent=share) for share in (50, 95)}


def measure(environment: dict[str, str]) -> dict[str, list[float]]:
    """Seconds: one per key press, silence, picture and start, and one for the time between two pictures."""
    with Simulation(port=0) as simulation:
        found = {
            "key to setpoint": drive_by_keyboard(simulation, environment, ORDINARY, PRESSES),
            "rest after silence": rest_after_silence(simulation, environment),
        }
        environment = {**environment, "QT_QPA_PLATFORM": "offscreen"}
        with camera_node(simulation.url, environment, ORDINARY):
            simulation.robot.set_velocity(0.0, 0.0, TURN)
            found["age when painted, it turns"], rate = watch(environment, ORDINARY)
            found["from one painted picture to the next"] = [1.0 / rate]
    os.environ[priority.OFF] = environment[priority.OFF]
    found["start to first picture"] = [time_up(command=ORDINARY)[0] for _ in range(STARTS)]
    return found


def rest_after_silence(simulation: Simulation, environment: dict[str, str]) -> list[float]:
    """Seconds from the death of whoever sends velocities until the robot stands."""
    robot = simulation.robot
    port = simulation.url.rpartition(":")[2]
    driver = processes.start(
        [*ORDINARY, "roslaunch", "naoqi_driver_py", "naoqi_driver.launch", "nao_ip:=127.0.0.1", f"nao_port:={port}"],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )

    def speed() -> float:
        return abs(robot.snapshot().velocity[2])

    found = []
    random.seed(1)
    try:
        for number in range(SILENCES):
            twist = f"{{angular: {{z: {TURN if number % 2 else -TURN}}}}}"
            pilot = subprocess.Popen(
                [*ORDINARY, "rostopic", "pub", "-r", "20", "cmd_vel", "geometry_msgs/Twist", twist],
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            wait_for(lambda: speed() > 0.9 * TURN, "the robot's full speed")
            time.sleep(random.uniform(0.0, 0.1))
            pilot.send_signal(signal.SIGKILL)
            begin = time.monotonic()
            while speed() > STANDS:
                time.sleep(PERIOD)
            found.append(time.monotonic() - begin)
            pilot.wait()
    finally:
        processes.end(driver)
    return found


@contextlib.contextmanager
def busy_processors(per_processor: int) -> Iterator[None]:
    """Programs that compute all the time, each in a session of its own, as different people's programs are."""
    count = per_processor * (os.cpu_count() or 1)
    loops = [processes.start([*ORDINARY, sys.executable, "-c", "while True: pass"], tied=True) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()
