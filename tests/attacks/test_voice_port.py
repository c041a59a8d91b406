"""A stranger attacks the port on which the node `voice` waits for Pepper's microphones.

Pilot, robot and stranger are three machines (network namespaces); the robot brings its sound from a program of its own,
which connects to that port. On the pilot's machine another node talks with a simulated robot.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from media.far_network import FarMachine, FarNetwork

from telepresence.station import processes

pytestmark = [pytest.mark.ros, pytest.mark.slow]

ROOT, HERE = Path(__file__).resolve().parents[2], Path(__file__).resolve().parent
VOICE = ROOT / "catkin_ws" / "devel" / "lib" / "telepresence_1" / "voice"
LOOPBACK = "tcp://127.0.0.1:9559"
NOBODY = 65534


class Rig:
    """Three machines; on the pilot's a ROS master, a node for the robot and one for a simulated robot."""

    def __init__(self, folder: Path, wait_until: Callable) -> None:
        words = subprocess.run(
            ["bash", "-c", '. "$0"/env.sh && env -0', str(ROOT)], check=True, capture_output=True, text=True
        ).stdout.split("\0")
        self._environment = {**os.environ, **dict(word.split("=", 1) for word in words if "=" in word)}
        self._folder, self._wait_until = folder, wait_until
        self._running: list[subprocess.Popen] = []
        self.network = FarNetwork(3)
        self.pilot, self.robot, self.stranger = self.network.machines
        self.robot_url = f"tcp://{self.robot.address}:9559"
        self.start(self.pilot, "rosmaster", "--core", "-p", "11311")
        listening = [
            self.start(machine, sys.executable, str(HERE / "voice_port_robot.py"), "listen", url)
            for machine, url in ((self.robot, self.robot_url), (self.pilot, LOOPBACK))
        ]
        options = ("_microphone:=none", "_speaker:=none", f"_rtp_host:={self.stranger.address}")
        self.nodes = [
            self.start(self.pilot, sys.executable, str(VOICE), f"__name:={name}", f"_pip:={url}", *options)[0]
            for name, url in (("far", self.robot_url), ("near", LOOPBACK))
        ]
        self.name, self.port = self._subscription(listening[0][1])
        self.near_name, self.near_port = self._subscription(listening[1][1])

    def start(self, machine: FarMachine, *argv: str) -> tuple[subprocess.Popen, Path]:
        log = self._folder / f"{len(self._running)}.log"
        self._running.append(machine.start(*argv, environment=self._environment, log=log))
        return self._running[-1], log

    def _subscription(self, log: Path) -> tuple[str, str]:
        line = self._wait_until(
            lambda: next((line for line in log.read_text().splitlines() if line.startswith("subscribed")), None),
            "a node listens for the robot's microphones",
        )
        _, name, *endpoints = line.split()
        return name, endpoints[0].rpartition(":")[2]

    def attack(self, machine: FarMachine, *words: str, user: int | None = None) -> str:
        """Do something to the port; what came of it."""
        # As text: another user may not be able to read the checkout.
        program = (HERE / "voice_port_stranger.py").read_text()
        command = machine.command("/usr/bin/python3", "-c", program, *words)
        if user is not None:
            command[2:2] = [f"--setuid={user}", f"--setgid={user}"]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout.strip()

    def robot_is_heard(self) -> bool:
        """A program of the robot that has not been connected so far brings sound."""
        command = self.robot.command(sys.executable, str(HERE / "voice_port_robot.py"), "bring", self.robot_url)
        done = subprocess.run([*command, self.name], capture_output=True, text=True, env=self._environment, timeout=60)
        return "taken" in done.stdout

    def close(self) -> None:
        for process in reversed(self._running):
            processes.end(process, patience=10.0)
        self.network.close()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory, wait_until: Callable) -> Iterator[Rig]:
    rig = Rig(tmp_path_factory.mktemp("voice"), wait_until)
    try:
        assert rig.robot_is_heard(), "before any attack"
        yield rig
    finally:
        rig.close()


def test_a_stranger_speaks_in_the_robots_place(rig: Rig) -> None:
    assert rig.attack(rig.stranger, "speak", rig.pilot.address, rig.port).startswith("no way")


def test_another_user_of_the_pilots_machine_speaks_in_the_robots_place(rig: Rig) -> None:
    """To the node of the robot elsewhere."""
    assert rig.attack(rig.pilot, "speak", rig.pilot.address, rig.port, user=NOBODY).startswith("no way")


def test_another_user_of_the_pilots_machine_speaks_in_a_simulated_robots_place(rig: Rig) -> None:
    assert rig.attack(rig.pilot, "speak", "127.0.0.1", rig.near_port, user=NOBODY).startswith("no way")


@pytest.mark.parametrize("count", [600, 10_000])
def test_resets_close_the_port_to_the_robot(count: int, rig: Rig) -> None:
    rig.attack(rig.stranger, "reset", rig.pilot.address, rig.port, str(count))
    assert rig.robot_is_heard()


def test_half_connections_keep_the_robot_out(rig: Rig, wait_until: Callable) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 4096)), hard))
    try:
        stranger, log = rig.start(
            rig.stranger, "/usr/bin/python3", str(HERE / "voice_port_stranger.py"),
            "half", rig.pilot.address, rig.port, "1024",
        )  # fmt: skip
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    wait_until(lambda: "holding" in log.read_text(), "half connections")
    try:
        files = len(os.listdir(f"/proc/{rig.nodes[0].pid}/fd"))
        assert rig.robot_is_heard() and files < 100, f"{files} files are open"
    finally:
        processes.end(stranger)
