"""The microphones of a robot that connects to the pilot's machine to bring their sound, as an ordinary Pepper does.

Robot and pilot are on machines of their own. The robot has a second address, from which a stranger speaks. There are
two robots: the simulated one, and one of the vendor's library.
"""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from machines import Machine, connect
from talker import Caller

from telepresence.station import processes

ROBOT, PILOT, STRANGER = "10.77.0.1", "10.77.0.2", "10.77.0.66"
PROGRAMS = Path(__file__).parent / "programs"
SIMULATED = ("-m", "pepper_sim", "--address", ROBOT, "--scene", "empty", "--room-sound", "tone", "--dials")
VENDORS = (str(PROGRAMS / "vendors_robot.py"), ROBOT)
PORT = 9561


class Machines:
    """A robot's machine, on which the robot runs, and a pilot's, on which `listen` starts a program."""

    def __init__(self, environment: dict[str, str], words: tuple[str, ...], wait_until: Callable) -> None:
        self._environment = environment
        self.robot, self.pilot = Machine(), Machine()
        connect(self.robot, self.pilot, "wire", (ROBOT, PILOT))
        self.robot.run("ip", "addr", "add", f"{STRANGER}/24", "dev", "wire", check=True)
        command = self.robot.command(sys.executable, *words)
        self._program = processes.start(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        wait_until(lambda: "listening on" in self._program.stdout.readline(), "the robot answers")
        self._pilots: list[Caller] = []

    def listen(self, url: str) -> Caller:
        with self.pilot.entered():
            self._pilots.append(Caller(self._environment, PROGRAMS / "listening_pilot.py", f"tcp://{ROBOT}:9559", url))
        return self._pilots[-1]

    def close(self) -> None:
        for pilot in self._pilots:
            pilot.close()
        processes.end(self._program, patience=10.0)
        self._program.stdin.close()
        self._program.stdout.close()
        self.robot.close()
        self.pilot.close()


@pytest.fixture
def machines(request: pytest.FixtureRequest, workspace_environment, wait_until: Callable) -> Iterator[Machines]:
    made = Machines(workspace_environment, getattr(request, "param", SIMULATED), wait_until)
    yield made
    made.close()


def said_to(place: tuple[str, int], machine: Machine, source: str) -> bytes:
    """What the listener answers somebody who connects from an address; nothing at all, if it ends the connection."""
    with machine.entered(), socket.create_connection(place, 10.0, (source, 0)) as stranger:
        try:
            stranger.sendall(bytes(28))
            return stranger.recv(100)
        except ConnectionError:
            return b""


@pytest.mark.parametrize("machines", [SIMULATED, VENDORS], ids=["simulated", "vendor's"], indirect=True)
def test_the_robot_connects_and_is_heard_and_nobody_else_may_connect(machines, wait_until) -> None:
    pilot = machines.listen("")
    wait_until(lambda: pilot.blocks() > 5, "the robot is heard")
    url = pilot.listens_at()
    place = PILOT, int(url.rpartition(":")[2])
    assert url == f"tcp://{PILOT}:{place[1]}", "not on all addresses"
    listening = machines.pilot.run("ss", "-Hltn").split("\n")
    assert [line.split()[3] for line in listening if line] == [f"{PILOT}:{place[1]}"]
    assert said_to(place, machines.robot, STRANGER) == b"" and said_to(place, machines.pilot, PILOT) == b""
    with machines.robot.entered(), socket.create_connection(place, 10.0, (ROBOT, 0)) as other_program:
        other_program.settimeout(0.5)
        with pytest.raises(TimeoutError):  # it may speak, though not for long
            other_program.recv(100)
    heard = pilot.blocks()
    wait_until(lambda: pilot.blocks() > heard + 5, "the sound goes on")


def test_a_port_that_was_chosen_is_used_again_and_again(machines, wait_until) -> None:
    pilot = machines.listen(f"tcp://0.0.0.0:{PORT}")
    for _ in range(2):
        heard = pilot.blocks()
        wait_until(lambda heard=heard: pilot.blocks() > heard + 5, "the robot is heard")
        assert pilot.listens_at() == f"tcp://{PILOT}:{PORT}"
        machines.robot.run("ip", "link", "set", "wire", "down", check=True)
        wait_until(lambda: not pilot.listens_at(), "the link is lost, and nothing listens")
        machines.robot.run("ip", "link", "set", "wire", "up", check=True)


def test_a_firewall_in_the_way_is_named(machines, wait_until) -> None:
    rule = f"table inet closed {{ chain in {{ type filter hook input priority 0; tcp dport {PORT} reject; }}; }}"
    assert machines.pilot.run("nft", rule) == ""
    pilot = machines.listen(f"tcp://0.0.0.0:{PORT}")
    wait_until(lambda: "find service" in pilot.problem(), "the robot refuses")
    assert f"tcp://{PILOT}:{PORT}" in pilot.problem() and "firewall" in pilot.problem()
    machines.pilot.run("nft", "delete", "table", "inet", "closed", check=True)
    wait_until(lambda: pilot.blocks() > 5, "the robot is heard")


def test_without_a_way_for_the_robot_that_is_told(machines, wait_until) -> None:
    pilot = machines.listen("tcp://127.0.0.1:0")
    wait_until(lambda: "find service" in pilot.problem(), "the robot refuses")
    assert "nothing listens" in pilot.problem() and "qi_listen_url" in pilot.problem()
    assert machines.pilot.run("ss", "-Hltn") == ""
