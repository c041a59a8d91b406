"""The drive server runs on the pilot's machine, and the network to Pepper is cut: nothing old arrives afterwards."""

from __future__ import annotations

import collections
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from media.far_network import FarMachine, FarNetwork

from telepresence.station import processes

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[4]
PACKAGE = ROOT / "catkin_ws" / "src" / "naoqi_driver_py"


@pytest.fixture
def network() -> Iterator[FarNetwork]:
    made = FarNetwork(2)
    made.delay = 0.005
    yield made
    made.close()


@pytest.fixture
def run_on() -> Iterator[Callable[..., subprocess.Popen]]:
    started: list[subprocess.Popen] = []

    def run(machine: FarMachine, *argv: object) -> subprocess.Popen:
        environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{PACKAGE / 'src'}", "PYTHONUNBUFFERED": "1"}
        words = machine.command(sys.executable, *map(str, argv))
        started.append(
            processes.start(words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        )
        return started[-1]

    yield run
    for process in reversed(started):
        processes.end(process, patience=10.0)
        process.stdin.close()
        process.stdout.close()


def test_after_a_cut_no_old_command_moves_the_robot(network, run_on, until_true):
    here, (mine, robots) = Path(__file__).parent, network.machines
    robot = run_on(robots, here / "far_pepper.py", robots.address)
    track: collections.deque[tuple[float, ...]] = collections.deque(maxlen=1000)
    reader = threading.Thread(target=lambda: track.extend(tuple(map(float, line.split())) for line in robot.stdout))
    reader.start()
    until_true(lambda: track, "the robot is there")
    server = run_on(
        mine, PACKAGE / "robot" / "drive_server.py", "--qi-url", f"tcp://{robots.address}:9559", "--port", "0"
    )
    pilot = run_on(mine, here / "far_pilot.py", server.stdout.readline().rpartition(" ")[2].strip())

    def drive(key: str) -> None:
        pilot.stdin.write(f"{key}\n")
        pilot.stdin.flush()

    def speed() -> float:
        """Over the last tenth of a second [m/s]."""
        latest = list(track)[-10:]
        return math.dist(latest[0], latest[-1]) / 0.1

    drive("hold")
    until_true(lambda: speed() > 0.15, "it drives")
    network.cut = True
    time.sleep(0.05)  # so that nothing on its way is let through
    drive("let go")
    until_true(lambda: speed() < 1e-3, "it rests although nobody reaches it")
    time.sleep(1.5)  # as long as cuts last that TCP survives
    rested = track[-1]
    network.cut = False
    time.sleep(1.5)  # in which nothing late may move it
    assert max(math.dist(rested, place) for place in list(track)[-150:]) < 1e-3
    drive("hold")
    until_true(lambda: speed() > 0.15, "it drives again")
    processes.end(robot, patience=10.0)
    reader.join(10.0)
