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
from tls_front import make_certificate

from telepresence.station import processes

pytestmark = pytest.mark.slow
LAB = Path(__file__).resolve().parents[3] / "lab"
ROOT = Path(__file__).resolve().parents[4]
PACKAGE = ROOT / "catkin_ws" / "src" / "naoqi_driver_py"


@pytest.fixture
def network() -> Iterator[FarNetwork]:
    made = FarNetwork(2)
    made.delay = 0.005
    yield made
    made.close()


@pytest.fixture
def run_on(tmp_path) -> Iterator[Callable[..., subprocess.Popen]]:
    started: list[subprocess.Popen] = []

    def run(machine: FarMachine, *argv: object) -> subprocess.Popen:
        path = f"{ROOT}:{PACKAGE / 'src'}:{LAB}"
        own = {"PYTHONPATH": path, "PYTHONUNBUFFERED": "1", "XDG_CONFIG_HOME": str(tmp_path)}
        words = machine.command(sys.executable, *map(str, argv))
        started.append(
            processes.start(words, env={**os.environ, **own}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        )
        return started[-1]

    yield run
    for process in reversed(started):
        processes.end(process, patience=10.0)
        process.stdin.close()
        process.stdout.close()


@pytest.mark.parametrize("url", ["tcp://{}:9559", "tcps://{}:9503"], ids=["tcp", "tls"])
def test_after_a_cut_no_old_command_moves_the_robot(url, network, run_on, wait_until, tmp_path):
    here, (mine, robots) = Path(__file__).parent, network.machines
    certificate = [make_certificate(tmp_path, "pepper")] if url.startswith("tcps") else []
    robot = run_on(robots, here / "far_pepper.py", robots.address, *certificate)
    track: collections.deque[tuple[float, ...]] = collections.deque(maxlen=1000)
    reader = threading.Thread(target=lambda: track.extend(tuple(map(float, line.split())) for line in robot.stdout))
    reader.start()
    wait_until(lambda: track, "the robot is there")
    server = run_on(mine, PACKAGE / "robot" / "drive_server.py", "--qi-url", url.format(robots.address), "--port", "0")
    said = next(line for line in server.stdout if "listens on udp" in line)
    pilot = run_on(mine, here / "far_pilot.py", said.rpartition(" ")[2].strip())

    def drive(key: str) -> None:
        pilot.stdin.write(f"{key}\n")
        pilot.stdin.flush()

    def speed() -> float:
        """Over the last tenth of a second [m/s]."""
        latest = list(track)[-10:]
        return math.dist(latest[0], latest[-1]) / 0.1

    drive("hold")
    wait_until(lambda: speed() > 0.15, "it drives")
    network.cut = True
    time.sleep(0.05)  # so that nothing on its way is let through
    drive("let go")
    wait_until(lambda: speed() < 1e-3, "it rests although nobody reaches it")
    time.sleep(1.5)  # as long as cuts last that TCP survives
    rested = track[-1]
    network.cut = False
    time.sleep(1.5)  # in which nothing late may move it
    assert max(math.dist(rested, place) for place in list(track)[-150:]) < 1e-3
    drive("hold")
    wait_until(lambda: speed() > 0.15, "it drives again")
    processes.end(robot, patience=10.0)
    reader.join(10.0)
