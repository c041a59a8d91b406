"""A stranger in the pilot's hotel, whose network the pilot's computer is in beside its VPN.

Three machines are network namespaces: the laptop with ROS_IP set to its address in the VPN, as docs/remote.md advises,
and with the firewall rules of the same page; a robot in the VPN (the rules know an interface and addresses: a wire
stands in for WireGuard); the stranger, who knows every port and sends packets for the laptop's address in the VPN, too.
"""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from machines import Machine, connect

from telepresence.station import processes

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]
RULES = ROOT / "telepresence" / "station" / "firewall.nft"
STRANGER = Path(__file__).parent / "ros_stranger.py"
VPN, ROBOT = "10.8.0.1", "10.8.0.3"
HOTEL, OUTSIDER = "192.168.77.2", "192.168.77.66"
PORT = 11311
STATION = textwrap.dedent(f"""
    import sys, threading
    from telepresence.station.master_keeper import MasterKeeper
    keeper = MasterKeeper("http://localhost:{PORT}")
    import rospy
    from geometry_msgs.msg import Twist
    from sensor_msgs.msg import Image
    from telepresence_ros.node import Node
    node = Node("victim")
    rospy.set_param("/sign_in", True)
    rospy.Publisher("camera/image_raw", Image, queue_size=1, latch=True).publish(Image(data=b"PICTURE"))
    rospy.Subscriber("cmd_vel", Twist, lambda message: print("driven", flush=True))
    print(rospy.get_node_uri(), flush=True)
    sys.stdin.read()
    keeper.close()
""")
ATTACKS = ("read_graph", "sign_in_off", "see_camera", "drive", "shut_down")
WAYS = pytest.mark.parametrize(
    "address", [HOTEL, VPN], ids=["at its address in the hotel", "at its address in the VPN"]
)


class Network:
    """The three machines, and what runs on the laptop."""

    def __init__(self, folder: Path) -> None:
        self.laptop, self.robot, self.outsider = self.machines = [Machine() for _ in range(3)]
        connect(self.laptop, self.robot, "wg0", (VPN, ROBOT))
        connect(self.laptop, self.outsider, "wlan0", (HOTEL, OUTSIDER))
        self.outsider.run("ip", "route", "add", f"{VPN}/32", "via", HOTEL)
        self.environment = {
            **os.environ, "ROS_IP": VPN, "ROS_MASTER_URI": f"http://localhost:{PORT}", "ROS_HOME": str(folder),
        }  # fmt: skip
        self.environment.pop("ROS_HOSTNAME", None)
        self._attacks: list[subprocess.Popen] = []
        if RULES.exists():
            rules = ("nft", "-D", "vpn=wg0", "-D", f"peers={{ {ROBOT} }}", "-f", str(RULES))
            subprocess.run(self.laptop.command(*rules), check=True, timeout=30)
        self.station = processes.start(
            self.laptop.command(sys.executable, "-c", STATION),
            env=self.environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.node_port = int(self.station.stdout.readline().strip().strip("/").rpartition(":")[2])

    def attack(self, machine: Machine, own: str, name: str, address: str) -> subprocess.Popen:
        uris = (f"http://{address}:{PORT}", f"http://{address}:{self.node_port}")
        words = uris[:1] if name in ("read_graph", "sign_in_off") else (*uris, own) if name == "drive" else uris
        program = machine.command(sys.executable, str(STRANGER), name, *words)
        patience = "2" if machine is self.outsider else "20"  # who is invited gets through on a busy machine, too
        environment = {**os.environ, "PATIENCE": patience}
        self._attacks.append(processes.start(program, env=environment, stdout=subprocess.PIPE, text=True))
        return self._attacks[-1]

    def attack_at_once(self) -> None:
        """Let the outsider try everything, at last what would end the node; a firewall that drops makes him wait."""
        self.attacks: dict[tuple[str, str], str] = {}
        for names in (ATTACKS[:-1], ATTACKS[-1:]):
            tried = {(n, a): self.attack(self.outsider, OUTSIDER, n, a) for n in names for a in (HOTEL, VPN)}
            self.attacks.update({key: program.communicate(timeout=60)[0] for key, program in tried.items()})

    def close(self) -> None:
        for program in self._attacks:
            processes.end(program)
            program.stdout.close()
        self.station.stdin.close()
        processes.end(self.station, patience=10.0)
        self.station.stdout.close()
        for machine in self.machines:
            machine.close()


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    made = Network(tmp_path_factory.mktemp("ros"))
    try:
        # Who is invited gets through, so the stranger's tools and the network work.
        for name in ATTACKS[:-1]:
            assert made.attack(made.robot, ROBOT, name, VPN).communicate(timeout=60)[0] == "through\n"
        assert made.station.stdout.readline() == "driven\n"
        made.attack_at_once()
        yield made
    finally:
        made.close()


@WAYS
@pytest.mark.parametrize("name", ATTACKS)
def test_a_stranger_in_the_hotel(network, name, address):
    """Reads the graph, turns the sign-in off, sees the camera, drives, ends a node: none of it."""
    assert "through" not in network.attacks[name, address]


@WAYS
def test_a_stranger_finds_a_port_that_answers(network, address):
    """Tries every port that a program of the laptop listens on."""
    listening = network.laptop.run("ss", "-Hltn").split("\n")
    ports = sorted({int(line.split()[3].rpartition(":")[2]) for line in listening if line})
    assert PORT in ports and network.node_port in ports
    knock = textwrap.dedent(f"""
        import socket, sys
        def answers(port):
            with socket.socket() as probe:
                probe.settimeout(0.3)
                return probe.connect_ex(("{address}", port)) == 0
        print([port for port in map(int, sys.argv[1:]) if answers(port)])
    """)
    assert network.outsider.run(sys.executable, "-c", knock, *map(str, ports)) == "[]\n"


def test_a_station_in_a_vpn_listens_where_nobody_expects_it(network):
    """The table of docs/security.md names every socket: loopback or ROS_IP, never all addresses."""
    import socket_table  # here, so that the other attacks of this file can be tried on versions without such a table

    pid = network.station.pid
    assert socket_table.compare(processes.descendants(pid), "VPN", {}, VPN) == []
    assert {found.address for found in socket_table.listening_of([pid])[pid]} == {VPN}, "the node"


@pytest.fixture
def bare_laptop():
    """A machine with an address in a VPN and without rules."""
    machine = Machine()
    subprocess.run(machine.command("ip", "link", "add", "wg0", "type", "veth"), check=True, timeout=10)
    subprocess.run(machine.command("ip", "addr", "add", f"{VPN}/24", "dev", "wg0"), check=True, timeout=10)
    yield machine
    machine.close()


def test_a_station_comes_up_for_everybody_because_the_rules_were_forgotten(bare_laptop, tmp_path):
    """`./stack up` with ROS_IP set ends with a sentence that says what to type."""
    environment = {**os.environ, "ROS_IP": VPN, "ROS_HOME": str(tmp_path), "ROS_MASTER_URI": f"http://localhost:{PORT}"}
    words = (sys.executable, "-m", "telepresence.station", "robotino", "gui:=false", "voice:=false")
    station = processes.start(
        bare_laptop.command(*words), env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        said = station.communicate(timeout=60)[0]
        assert "the rules are not loaded" in said, said
        assert "firewall.nft" in said and "firewall:=mine" in said
        assert station.returncode == 1
    finally:
        processes.end(station, patience=10.0)
        station.stdout.close()


def test_rules_that_let_more_in_pass_for_ours(bare_laptop, tmp_path):
    """A port that is missing in the set, or a further rule, is found by the doctor and by `./stack up`."""
    rules = RULES.read_text()
    load = bare_laptop.command("nft", "-D", "vpn=wg0", "-D", f"peers={ROBOT}", "-f")
    check = (sys.executable, "-c", "from telepresence.station import firewall; print(firewall.problem())")
    for change, word in (
        (("11311, ", ""), "11311"),
        (("32768-60999", "32768-50000"), "60999"),
        (('iif "lo" accept', 'iif "lo" accept\n    tcp dport 11311 accept'), "not those"),
        (("ip saddr $peers", "ip saddr { 10.8.0.3, 10.0.0.0/8 } counter"), "not those"),
        (("", ""), "None"),
    ):
        file = tmp_path / "rules.nft"
        file.write_text(rules.replace(*change) if change[0] else rules)
        subprocess.run([*load, str(file)], check=True, timeout=30)
        assert word in bare_laptop.run(*check, cwd=ROOT), change
