"""What one pilot's link carries: every wire between pilot and robot, counted packet by packet between two machines.

Robot and pilot are in network namespaces of their own (see far_network.py; needs root). Both directions together,
headers of IP and above included. Each stream runs alone, by the same programs as in use.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from media.far_network import FarMachine, FarNetwork
from report import Row

from telepresence.security.robot_key import RobotKey
from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[2]
NODES = ROOT / "catkin_ws" / "devel" / "lib"
WARM_UP, SECONDS = 5.0, 6.0
RAW = 640 * 480 * 3 * 8 / 1e6
"""A picture without compression [Mbit]."""
TURNER = """
import sys, time, urllib.request
while True:
    urllib.request.urlopen(urllib.request.Request(sys.argv[1], b"[0.0, 0.0, 0.5]"), timeout=5.0).close()
    time.sleep(0.1)
"""
"""Turns a Robotino on the spot, from its own machine."""
UPLINK = 10.0
"""What a robot may count on where it lives: a modest line out of a house [Mbit/s]."""


def run() -> list[Row]:
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        network = FarNetwork(2)
        stack.callback(network.close)
        pilot, robot = network.machines
        start = Programs(stack, Path(folder))
        start(pilot, "rosmaster", "--core", "-p", "11311")
        place = ("--address", robot.address, "--scene", "apartment")
        start(robot, sys.executable, "-m", "robotino_sim", "--camera", "640x480", *place)
        start(robot, sys.executable, "-m", "pepper_sim", *place)
        os.environ["XDG_CONFIG_HOME"] = folder  # the pilot's store of keys
        RobotKey.make(Path(folder) / "robot.key").store(robot.address)
        start(robot, str(NODES / "rto_bringup/robotino_onboard"), *f"camera --source {robot.address}:8080".split(),
              *f"--address {robot.address} --rate 30 --key {folder}/robot.key".split())  # fmt: skip
        time.sleep(WARM_UP)
        rest = ("--hostname", f"{robot.address}:8080")
        naoqi = (f"--pip={robot.address}", "--pport=9559")
        rows = []
        for what, reference, name, programs in (
            ("Robotino by REST: driven, all its sensors", UPLINK, "an uplink of 10 Mbit/s", [
                ("rto_node/rto_node", *rest), ("rto_node/rto_odometry_node", *rest), drive("/cmd_vel")]),
            ("Robotino's camera as JPEG, 640x480, 15/s, turning", 15 * RAW, "15 raw pictures/s", [
                ("rto_node/rto_camera_node", *rest), viewer_of("/image_raw")]),
            ("Robotino's camera by WebRTC, 640x480, turning", 30 * RAW, "30 raw pictures/s", [
                ("rto_node/rto_camera_receiver", f"_sender:={robot.address}:8083"), viewer_of("/img_raw")]),
            ("Pepper by NAOqi: driven, all its sensors", UPLINK, "an uplink of 10 Mbit/s", [
                ("naoqi_driver_py/naoqi_moveto.py", *naoqi), ("naoqi_driver_py/naoqi_joint_states.py", *naoqi),
                ("pepper_sensors_py/laser.py", *naoqi), ("pepper_sensors_py/sonar.py", *naoqi), drive("/cmd_vel")]),
            ("Pepper's camera by NAOqi, 640x480 YUV422, 15/s", 15 * RAW, "15 raw pictures/s", [
                ("pepper_sensors_py/camera.py", *naoqi, "_source:=0", "_resolution:=2", "_frame_rate:=15",
                 "_color_space:=9", "__name:=front"), viewer_of("/front/image_raw")]),
        ):  # fmt: skip
            # The robot keeps turning while it is watched: a picture that stands still costs a video nearly nothing.
            turner = [(sys.executable, "-c", TURNER, f"http://{robot.address}:8080/data/omnidrive")]
            with start.running(robot, turner if "WebRTC" in what or "JPEG" in what else []):
                rows.append(Row(what, measure(network, start, programs), reference, "Mbit/s", name))
        return rows


class Programs:
    """Starts programs on machines; they end with the stack, or on request."""

    def __init__(self, stack: contextlib.ExitStack, folder: Path) -> None:
        self._stack, self._folder, self._count = stack, folder, 0

    def __call__(self, machine: FarMachine, *argv: str) -> subprocess.Popen:
        self._count += 1
        log = self._folder / f"{self._count}.log"
        process = machine.start(*argv, environment=dict(os.environ), log=log)
        self._stack.callback(processes.end, process)
        return process

    @contextlib.contextmanager
    def running(self, machine: FarMachine, programs: list[tuple[str, ...]]) -> Iterator[list[subprocess.Popen]]:
        running = []
        try:
            for program in programs:
                path = NODES / program[0]
                running.append(self(machine, str(path) if path.exists() else program[0], *program[1:]))
            yield running
        finally:
            for process in running:
                processes.end(process)


def measure(network: FarNetwork, start: Programs, programs: list[tuple[str, ...]]) -> float:
    """Mbit/s between the two machines while `programs` run at the pilot's."""
    with start.running(network.machines[0], programs) as running:
        time.sleep(WARM_UP)
        begin, before = time.monotonic(), sum(network.carried.values())
        time.sleep(SECONDS)
        carried, seconds = sum(network.carried.values()) - before, time.monotonic() - begin
        ended = [process.args[-1] for process in running if process.poll() is not None]
        if ended or not carried:
            raise RuntimeError(f"nothing was carried, or a program ended: {ended}")
    return carried * 8 / 1e6 / seconds


def drive(topic: str) -> tuple[str, ...]:
    return ("rostopic", "pub", "-r", "10", topic, "geometry_msgs/Twist", "{angular: {z: 0.2}}")


def viewer_of(topic: str) -> tuple[str, ...]:
    return ("rostopic", "hz", topic)


if __name__ == "__main__":
    from report import table

    print(table(run()))
