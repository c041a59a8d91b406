"""`./stack up`: robots, real or simulated, with drivers, tablet page, teleoperation and the operator's window.

Starts roscore (and restarts it when it dies), a virtual display where there is no real one, and roslaunch with the
launch file of the robot. Ctrl-C ends all of it. No process is left behind, even if this program is killed.
"""

from __future__ import annotations

import argparse
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import xml.etree.ElementTree
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TextIO
from urllib.parse import urlsplit

from telepresence.security.private_files import restrict_new_files
from telepresence.station import firewall, heartbeat, processes, start_conditions, station_folder, vitals
from telepresence.station.faults import SOCKET as FAULTS
from telepresence.station.faults import FaultReporter
from telepresence.station.kept_program import KeptProgram
from telepresence.station.listening import listening
from telepresence.station.log_folder import LogKeeper
from telepresence.station.master_keeper import MasterKeeper
from telepresence.station.ros_master import master_answers, master_proxy
from telepresence.station.station_folder import StationFolder
from telepresence.station.unprivileged import STAY, must_leave_root
from telepresence.station.virtual_display import VirtualDisplay, display_answers
from telepresence.station.vitals import Beats
from telepresence.stop_signals import stop_on
from telepresence.web.page_auth import page_key

LAUNCH = Path(__file__).resolve().parents[2] / "launch"
SCENES = Path(__file__).resolve().parents[1] / "sim" / "scenes"
PAGE_PORT, SCREEN_PORT, ROBOT_PAGE_PORT = 10002, 10003, 8081
PAGE_KEY, SCREEN_KEY = "TELEPRESENCE_PAGE_KEY", "TELEPRESENCE_SCREEN_KEY"
ROBOT_PAGE_KEY = "TELEPRESENCE_ROBOT_PAGE_KEY"
"""Environment variables with the keys to the tablet's page, to the window's and to that of a simulated Pepper's owner:
the banner says them, and the programs that serve the pages find them there, where other users of the machine cannot
read them."""


@dataclass(frozen=True)
class Simulator:
    """How a robot is reached: launch arguments for address and port, the scheme, the usual ports."""

    name: str
    address: str
    port: str
    scheme: str
    simulated_port: int
    real_port: int


PEPPER = Simulator("pepper", "nao_ip", "nao_port", "tcp", 9559, 9559)
ROBOTINO = Simulator("robotino", "robotino_ip", "robotino_port", "http", 8080, 80)
STATIONS: dict[str, tuple[Simulator, ...]] = {"pepper": (PEPPER,), "robotino": (ROBOTINO,), "both": (PEPPER, ROBOTINO)}
"""Launch file -> the robots in it that have an address. The other launch files choose their ports themselves."""
OWN_SETTINGS = {"screen_port", "firewall"}
"""Settings that are ours and not the launch file's."""
RUN_ID_PATIENCE = 3.0
"""Seconds within which a starting roscore must set its run_id."""
LAUNCH_TIMEOUTS = ("--sigint-timeout=5", "--sigterm-timeout=2")


def main(argv: list[str] | None = None) -> int:
    arguments = parse(sys.argv[1:] if argv is None else argv)
    if must_leave_root():
        print(f"stack up: not as root: run ./stack up, which becomes another user, or set {STAY}=1", file=sys.stderr)
        return 1
    stop = threading.Event()
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    processes.adopt_orphans()
    restrict_new_files()  # logs, in which stands what was said, too
    folder = None
    try:
        for left in station_folder.sweep():
            print(f"Left by a station that was killed, and ended or removed now: {left}", file=sys.stderr)
        start_conditions.require_room()
        folder = StationFolder()
        start_conditions.say_all(
            start_conditions.raise_descriptor_limit(), start_conditions.choose_log_folder(folder.path / "log")
        )
        return run(arguments, stop)
    except (RuntimeError, OSError) as error:
        say(f"stack up: {error}", sys.stderr)
        return 1
    finally:
        processes.end_descendants()
        if folder is not None:
            folder.close()


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the robot and the launch arguments.

    Raises:
        SystemExit: With a usage line, for an unknown robot or an argument that is not name:=value.
    """
    robots = sorted(path.stem for path in LAUNCH.glob("*.launch"))
    parser = argparse.ArgumentParser(
        prog="./stack up",
        description="Bring up a robot, real or simulated, with everything that drives it.",
        epilog="Launch arguments and their defaults:  ./stack exec roslaunch --ros-args launch/pepper.launch",
    )
    parser.add_argument("robot", nargs="?", default="pepper", help=f"one of: {', '.join(robots)}; default pepper")
    parser.add_argument("settings", nargs="*", metavar="name:=value", help="arguments for the launch file")
    found = parser.parse_args(argv)
    if ":=" in found.robot:
        found.settings.insert(0, found.robot)
        found.robot = "pepper"
    if found.robot not in robots:
        parser.error(f"there is no robot '{found.robot}'; known: {', '.join(robots)}")
    for setting in found.settings:
        name, sign, _ = setting.partition(":=")
        if not sign or not name.isidentifier():
            parser.error(f"'{setting}' is not of the form name:=value")
    found.settings = dict(setting.split(":=", 1) for setting in found.settings)
    return found


def run(arguments: argparse.Namespace, stop: threading.Event) -> int:
    """Bring everything up and wait until `stop` is set or roslaunch ends.

    Raises:
        RuntimeError: A port is taken or a part does not start; the text says which and what to do.
    """
    settings = arguments.settings
    simulated = settings.get("sim", "true").lower() in ("true", "1")
    window = "gui" in launch_arguments(arguments.robot) and settings.get("gui", "true").lower() in ("true", "1")
    wires = STATIONS.get(arguments.robot, ())
    require_known(arguments.robot, settings)
    if not (os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP")):
        os.environ["ROS_IP"] = "127.0.0.1"  # without any, ROS announces the host name and listens everywhere
    LogKeeper().start()
    require_protection(settings.get("firewall"))
    if simulated:
        for wire in wires:
            require_loopback(settings, wire.address)
            port = port_setting(settings, wire.port, wire.simulated_port)
            require_free(port, wire.port, f"the simulated {wire.name}")
    if PEPPER in wires and simulated:
        robot_page = port_setting(settings, "robot_page_port", ROBOT_PAGE_PORT)
        require_free(robot_page, "robot_page_port", "the simulated Pepper's own page")
    if PEPPER in wires:
        require_free(port_setting(settings, "page_port", PAGE_PORT), "page_port", "the tablet's page")
    for server in drive_servers(arguments.robot, settings, simulated):
        require_free(port_setting(settings, server.argument, server.port), server.argument, server.purpose, udp=True)
    screen_port = port_setting(settings, "screen_port", SCREEN_PORT)

    master_uri = os.environ.setdefault("ROS_MASTER_URI", "http://localhost:11311")
    start_conditions.require_no_station(master_uri)
    for variable in (PAGE_KEY, SCREEN_KEY, ROBOT_PAGE_KEY):
        os.environ[variable] = page_key(variable)
    watch = Path(os.environ[station_folder.VARIABLE]) / "watch"
    watch.mkdir(mode=0o700)
    faults = FaultReporter(watch / FAULTS)
    keeper = screen = display = None
    kept: list[KeptProgram] = []
    try:
        if window and not display_answers(os.environ.get("DISPLAY")):
            require_free(screen_port, "screen_port", "the picture of the window")
            display = VirtualDisplay()
            os.environ.update(display.environment)
            screen = KeptProgram("screen_page", partial(serve_screen, display, screen_port), faults.report)
            kept = [KeptProgram("Xvfb", partial(restart_display, display), faults.report), screen]
        # roslaunch reads its files while roscore starts.
        beats = Beats(watch / "roslaunch")
        launch = KeptProgram(
            "roslaunch",
            partial(start_roslaunch, arguments.robot, settings, watch, beats),
            faults.report,
            beats,
            ended=lambda code: code >= 0,  # somebody asked it to end, or it has said itself what is wrong
        )
        if master_answers(master_uri, timeout=1.0):
            require_roscore(master_uri, stop)
            print(f"Using the ROS master that runs at {master_uri}")
            print(exposure(master_uri), end="")
        else:
            keeper = MasterKeeper(master_uri, watch, faults.report)
        print(banner(arguments.robot, settings, master_uri, simulated, display, screen_port), flush=True)
        heartbeat.notify("READY=1")
        looked = time.monotonic()
        while not stop.wait(vitals.PERIOD):
            heartbeat.beat()
            elapsed, looked = time.monotonic() - looked, time.monotonic()
            code = launch.look(elapsed)
            if code is not None:
                say("roslaunch ended", sys.stderr)
                return code or 1
            for program in kept:
                program.look(elapsed)
            faults.flush()
            processes.reap_orphans({program.pid for program in (*kept, launch, keeper) if program is not None})
        heartbeat.notify("STOPPING=1")
        say("\nEnding everything ...")
        launch.close(patience=8.0)
        return 0
    finally:
        if screen is not None:
            screen.close(patience=2.0)
        if keeper is not None:
            keeper.close()
        if display is not None:
            display.close()


def start_roslaunch(robot: str, settings: dict[str, str], watch: Path, beats: Beats) -> subprocess.Popen:
    """Start roslaunch with the launch file of the robot; it goes on with the nodes of one that was killed."""
    command = [sys.executable, "-m", "telepresence_ros.roslaunch", "--wait", *LAUNCH_TIMEOUTS]
    chosen = [f"{name}:={value}" for name, value in settings.items() if name not in OWN_SETTINGS]
    return processes.start(
        [*command, str(LAUNCH / f"{robot}.launch"), *chosen],
        tied=True,
        env={**os.environ, "NOTIFY_SOCKET": str(beats.path), "TELEPRESENCE_WATCH": str(watch)},
    )


def restart_display(display: VirtualDisplay) -> subprocess.Popen:
    """Return the display's process, a new one if it has ended: what had windows there is started again by roslaunch."""
    if display.process.poll() is not None:
        display.start_again()
    return display.process


def say(text: str, stream: TextIO | None = None) -> None:
    """Print a line, to standard output or `stream`. Who has closed the terminal reads nothing any more: then what we
    print goes nowhere from now on, as writing there fails."""
    try:
        print(text, file=stream, flush=True)
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)


def launch_arguments(robot: str) -> set[str]:
    """Return the names of the arguments that a person can give to the launch file."""
    file = xml.etree.ElementTree.parse(LAUNCH / f"{robot}.launch")
    return {argument.get("name", "") for argument in file.getroot().iterfind("arg") if argument.get("value") is None}


def require_known(robot: str, settings: dict[str, str]) -> None:
    """Raise RuntimeError when the launch file has no such argument, or there is no such scene; roslaunch itself ignores
    the former and starts a simulator that ends at once with the latter."""
    known = sorted(launch_arguments(robot) | OWN_SETTINGS)
    for name in settings:
        if name not in known:
            raise RuntimeError(f"{robot} has no argument '{name}'; arguments: {', '.join(known)}")
    scenes = sorted(path.stem for path in SCENES.glob("*.xml"))
    for name in ("scene", "terrain"):
        if settings.get(name, scenes[0]) not in scenes:
            raise RuntimeError(f"there is no {name} '{settings[name]}'; there are: {', '.join(scenes)}")


def require_loopback(settings: dict[str, str], name: str) -> None:
    """Raise RuntimeError when the drivers would drive a real robot while a simulated one starts too."""
    address = settings.get(name, "127.0.0.1")
    if address not in ("127.0.0.1", "localhost"):
        raise RuntimeError(f"{name}:={address} is no simulated robot: add sim:=false for a real one")


def require_protection(firewall_setting: str | None) -> None:
    """Raise RuntimeError when other machines reach ROS and the firewall rules are not loaded, unless the person says
    `firewall:=mine`: who reaches a ROS master or node may do everything that the pilot may."""
    if firewall_setting not in (None, "mine"):
        raise RuntimeError(f"firewall:={firewall_setting}: mine is the only value; without it ours is looked for")
    address = firewall.announced_address()
    if address is None or firewall_setting == "mine":
        return
    problem = firewall.problem()
    if problem is not None:
        raise RuntimeError(
            f"ROS would listen on {address}, where whoever reaches it drives the robot without a password, and "
            f"{problem}. Load them, with your interface and the addresses of your robots:\n"
            f"  {firewall.advice()}\n"
            "or add  firewall:=mine  if rules of your own do the same, or drive without other machines:  unset ROS_IP "
            "ROS_HOSTNAME.  docs/remote.md says more"
        )


def exposure(uri: str) -> str:
    """Return a line that says on which ports a roscore that somebody else started listens on every address of this
    machine; empty when on none."""
    master: Any = master_proxy(uri, timeout=1.0)  # XML-RPC answers have no types
    _, _, rosout = master.lookupNode("/stack_up", "/rosout")
    ports = {urlsplit(address).port for address in (uri, rosout)}
    open_ports = sorted({found.port for found in listening().values() if found.everywhere} & {*filter(None, ports)})
    if not open_ports:
        return ""
    return (
        f"It listens on every address of this machine (port {', '.join(map(str, open_ports))}): whoever is in the "
        "network can reach it. End it, and ./stack up starts one that is only reached from here.\n"
    )


def require_roscore(uri: str, stop: threading.Event) -> None:
    """Raise RuntimeError when a bare rosmaster runs at `uri`: roslaunch would wait for its run_id for ever."""
    deadline = time.monotonic() + RUN_ID_PATIENCE
    master: Any = master_proxy(uri, timeout=1.0)  # XML-RPC answers have no types
    while master.getParam("/stack_up", "/run_id")[0] != 1 and not stop.wait(0.1):
        if time.monotonic() > deadline:
            raise RuntimeError(
                f"the ROS master at {uri} is a bare rosmaster, without the run_id that roscore gives it and that "
                "roslaunch waits for. Run roscore instead, or:  rosparam set /run_id $(uuidgen)"
            )


class DriveServer(NamedTuple):
    """A drive server that a station starts here: the launch argument with its udp port, the usual one, whose it is."""

    argument: str
    port: int
    purpose: str


def drive_servers(robot: str, settings: dict[str, str], simulated: bool) -> list[DriveServer]:
    """Return the drive servers of a station. Where another station's has the port, this one's would not start, and its
    driver would drive the other one's robot."""
    wires, both = STATIONS.get(robot, ()), robot == "both"
    found = []
    elsewhere = settings.get("pepper_drive_server" if both else "drive_server", "")
    if PEPPER in wires and not elsewhere and settings.get("watchdog", "true").lower() in ("true", "1"):
        usual = int(os.environ.get("DRIVE_PORT", 8085))
        found.append(DriveServer("pepper_drive_port" if both else "drive_port", usual, "Pepper's drive server"))
    if ROBOTINO in wires and simulated:
        found.append(DriveServer("drive_port", 8082, "Robotino's drive server"))
    return found


def require_free(port: int, argument: str, purpose: str, udp: bool = False) -> None:
    """Raise RuntimeError when the loopback port is in use already."""
    with socket.socket(type=socket.SOCK_DGRAM if udp else socket.SOCK_STREAM) as probe:
        if not udp:  # of tcp, connections that have ended may linger there
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            raise RuntimeError(
                f"{'udp ' if udp else ''}port {port}, wanted for {purpose}, is taken: another ./stack up may be "
                f"running. Choose another one with {argument}:=<port>"
            ) from None


def serve_screen(display: VirtualDisplay, port: int) -> subprocess.Popen:
    """Start a web server for the picture of the display, as a separate process so that it cannot slow driving."""
    return processes.start(
        ["nice", sys.executable, "-m", "telepresence.station.screen_page", str(display.folder), "--port", str(port)],
        tied=True,
        stdout=subprocess.DEVNULL,
    )


def port_setting(settings: dict[str, str], name: str, default: int) -> int:
    """Return the port that the person chose. Raise RuntimeError when it is none."""
    text = settings.get(name, str(default))
    if not (text.isascii() and text.isdigit() and 0 < int(text) < 65536):
        raise RuntimeError(f"{name}:={text} is not a port: a number from 1 to 65535 is needed")
    return int(text)


def banner(
    robot: str,
    settings: dict[str, str],
    master_uri: str,
    simulated: bool,
    display: VirtualDisplay | None,
    screen_port: int,
) -> str:
    """Return what runs where, for the person at the terminal."""
    wires = STATIONS.get(robot, ())
    lines = [""]
    for wire in wires:
        usual, kind = (wire.simulated_port, "simulated") if simulated else (wire.real_port, "real")
        address, port = settings.get(wire.address, "127.0.0.1"), settings.get(wire.port, usual)
        lines.append(f"  robot        {wire.name}, {kind}, {wire.scheme}://{address}:{port}")
    lines.append(f"  ROS master   {master_uri}")
    if PEPPER in wires:
        page = f"http://127.0.0.1:{settings.get('page_port', PAGE_PORT)}/?k={os.environ.get(PAGE_KEY, '')}"
        lines.append(f"  tablet page  {page if simulated else 'com_cam prints its address, with the key to it'}")
    if PEPPER in wires and simulated:
        port = settings.get("robot_page_port", ROBOT_PAGE_PORT)
        lines.append(f"  owner's page http://127.0.0.1:{port}/?k={os.environ.get(ROBOT_PAGE_KEY, '')}")
    if display is not None:
        lines += [
            f"  window       http://127.0.0.1:{screen_port}/?k={os.environ.get(SCREEN_KEY, '')}",
            f"               There is no display here, so the window is on a virtual one ({display.name}).",
        ]
    lines += ["", "  Ctrl-C ends all of it.", ""]
    return "\n".join(lines)
