"""`./stack doctor [--security] [ADDRESS]`: what is installed, built and reachable; what is wrong and how to fix it.

Runs on Debian's Python alone, because it is needed when the rest does not work.
"""

from __future__ import annotations

import argparse
import email.utils
import ipaddress
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.parse
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # this file is run by its path
from telepresence.ports import NAOQI, PILOT_PAGE, TABLET_PAGE  # noqa: E402
from telepresence.security.bounded_http import BadAnswer, BoundedConnection  # noqa: E402
from telepresence.security.outside_text import LONGEST_LOG, clean  # noqa: E402
from telepresence.station.container_image import in_image  # noqa: E402
from telepresence.station.own_addresses import is_ours  # noqa: E402

OS_RELEASE = Path("/etc/os-release")
WEB_PORTS = (80, 8080)
"""Where a Robotino's web server listens, real and simulated."""
WEB_TIMEOUT = 3.0
"""Seconds allowed for a whole page of the robot's."""
LARGEST_PAGE = 1024 * 1024
"""[bytes]"""
SSH_PORT = 22
SSH_TIMEOUT = 4.0
"""[s]"""
ROUND_TRIPS = 10
SLOW = 0.15
"""Longest round trip at which the pilot still reacts in time to what the picture shows [s]."""
WRONG_CLOCK = 5.0
"""Difference of two clocks that is reported [s]."""
Finding = tuple[bool, str, str]
"""(whether it is as it should be, what was checked, what to do about it)"""


def main() -> int:
    parser = argparse.ArgumentParser(prog="./stack doctor", description="What works here, and how to fix the rest.")
    parser.add_argument(
        "address",
        nargs="?",
        help="also check the way to a robot (ping, ssh, its server, delay, clock): host, host:port; 9559 unless given, "
        "a Robotino has 80",
    )
    parser.add_argument(
        "--security",
        action="store_true",
        help="instead: what an attacker could exploit: open sockets, files, keys, old libraries (docs/security.md)",
    )
    arguments = parser.parse_args()
    if arguments.security:
        from telepresence.station import doctor_security

        well = report(lambda: doctor_security.findings(arguments.address))
        print("\nNothing here helps an attacker." if well else "\nFix what is marked with an x, then run this again.")
        return 0 if well else 1
    well = True
    for check in (system, programs, environment, workspace, rendering, ports, master, protection, processors):
        well = report(check) and well
    if arguments.address:
        well = report(lambda: robot(arguments.address)) and well
    print("\nEverything works." if well else "\nFix what is marked with an x, then run this again.")
    return 0 if well else 1


def report(check: Callable[[], Iterator[Finding]]) -> bool:
    """Print what a check finds; True if all of it is as it should be."""
    well = True
    for fine, what, remedy in check():
        what, remedy = clean(what, LONGEST_LOG), clean(remedy, LONGEST_LOG)
        print(f"  {'✓' if fine else 'x'} {what}" + ("" if fine else f"\n      -> {remedy}"))
        well = well and fine
    return well


def system() -> Iterator[Finding]:
    try:
        lines = OS_RELEASE.read_text().splitlines()
    except OSError:
        lines = []
    release = {name: value.strip('"') for name, sign, value in (line.partition("=") for line in lines) if sign}
    name = release.get("PRETTY_NAME", "unknown")
    # What is made from Debian 12 says so by one of these, as ./stack reads them, too.
    supported = "bookworm" in (release.get("VERSION_CODENAME"), release.get("DEBIAN_CODENAME"))
    remedy = "Debian 12 is the last one with ROS 1 in its archive; elsewhere the container runs: docs/container.md"
    yield supported, f"operating system: {name}", remedy


def programs() -> Iterator[Finding]:
    built = () if in_image() else ("catkin_make",)
    for program in ("roslaunch", "roscore", *built, "xterm", "tmux", "Xvfb", "espeak-ng"):
        yield shutil.which(program) is not None, f"program {program}", "run:  ./stack build"


def environment() -> Iterator[Finding]:
    python = ROOT / ".venv/bin/python"
    if not python.exists():
        yield False, "virtual environment .venv", "run:  ./stack build"
        return
    for module in ("rospy", "numpy", "mujoco", "cv2", "flask", "gevent", "aiohttp", "aiortc", "PyQt5.QtWidgets"):
        answer = subprocess.run([python, "-c", f"import {module}"], capture_output=True, text=True, timeout=120)
        reason = (answer.stderr.strip().splitlines() or [""])[-1]
        yield answer.returncode == 0, f"Python module {module}", f"{reason}; run:  rm -r .venv; ./stack build"


def workspace() -> Iterator[Finding]:
    stamp = ROOT / "catkin_ws/devel/built"
    yield stamp.exists(), "catkin workspace built", "run:  ./stack build"
    if stamp.exists():
        here = stamp.read_text().startswith(f"{ROOT} ")
        yield here, "catkin workspace built in this folder", "the checkout was moved; run:  ./stack build"


def rendering() -> Iterator[Finding]:
    python = ROOT / ".venv/bin/python"
    code = (
        "import os; os.environ.setdefault('MUJOCO_GL', 'egl'); import mujoco;"
        "model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size=\".1\"/></worldbody></mujoco>');"
        "data = mujoco.MjData(model); mujoco.mj_forward(model, data); renderer = mujoco.Renderer(model, 48, 64);"
        "renderer.update_scene(data); assert renderer.render().max() > 0"
    )
    try:
        # -P: nothing that lies in the current folder is imported, least of all in one where everybody writes.
        answer = subprocess.run([python, "-P", "-c", code], capture_output=True, text=True, timeout=120, cwd="/")
    except OSError as error:
        yield False, "pictures without a screen (EGL)", f"{error}; run:  ./stack build"
        return
    reason = (answer.stderr.strip().splitlines() or [""])[-1]
    yield answer.returncode == 0, "pictures without a screen (EGL)", f"{reason}; install libegl1 and libgl1-mesa-dri"


def ports() -> Iterator[Finding]:
    for port, argument in (
        (NAOQI, "nao_port"),
        (TABLET_PAGE, "page_port"),
        (PILOT_PAGE, "pilot_page_port"),
    ):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
                free = True
            except OSError:
                free = False
        state = "free" if free else "taken"
        yield free, f"port {port} is {state}", f"a stack runs already, or pass another one with {argument}:=<port>"


def master() -> Iterator[Finding]:
    uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
    place = urllib.parse.urlparse(uri)
    try:
        socket.create_connection((place.hostname or "localhost", place.port or 11311), timeout=1.0).close()
        print(f"  ✓ ROS master: answers at {uri}")
    except OSError:
        if is_ours(place.hostname or "localhost"):
            print(f"  - ROS master: none at {uri}; ./stack up starts one")
        else:
            yield False, f"ROS master: none at {uri}", "to run everything on this machine:  unset ROS_MASTER_URI"
    name = socket.gethostname()
    try:
        socket.getaddrinfo(name, None)
        resolves = True
    except OSError:
        resolves = bool(os.environ.get("ROS_IP") or os.environ.get("ROS_HOSTNAME"))
    yield resolves, f"host name {name} resolves, or ROS_IP is set", "run:  . ./env.sh  (it sets ROS_IP=127.0.0.1)"


def protection() -> Iterator[Finding]:
    """Check the firewall rules when other machines reach the ROS nodes of this one."""
    sys.path.insert(0, str(ROOT))  # this file runs by its path, on Debian's Python
    from telepresence.station import firewall

    address = firewall.announced_address()
    if address is None:
        print("  ✓ ROS nodes: reached from this machine only")
        return
    problem = firewall.problem()
    remedy = f"{problem}: whoever reaches it drives the robot. Load them:  {firewall.advice()}  (docs/remote.md)"
    yield problem is None, f"firewall rules, because ROS listens on {address}", remedy


def processors() -> Iterator[Finding]:
    """Say whether commands may overtake other programs; without that everything works, but later on a busy machine."""
    from telepresence.station import priority

    got = priority.allowed()
    if got != "SCHED_RR":
        print(
            f"  - busy processors: commands wait for other programs ({got}; docs/faults.md says how to allow SCHED_RR)"
        )
        return
    yield True, "busy processors: commands wait for no other program (SCHED_RR)", ""


def robot(address: str) -> Iterator[Finding]:
    """Check the way to a robot: name, ping, ssh, port, round trip, our own address towards it, and its clock."""
    host, _, port = address.partition(":")
    number = int(port) if port.isdigit() else NAOQI
    try:
        found = socket.getaddrinfo(host, number, type=socket.SOCK_STREAM)[0][4][0]
    except (socket.gaierror, UnicodeError):
        remedy = f"no name server knows '{host}'; press the chest button for the address"
        yield False, f"robot at {host}:{number}", remedy
        return
    if not ipaddress.ip_address(str(found).partition("%")[0]).is_loopback:
        ping(host)  # before ssh: a robot that sleeps in the wireless network wakes up by it
        ssh(host)
    try:
        times = sorted(connect_time(host, number) for _ in range(ROUND_TRIPS))
    except ConnectionRefusedError:
        remedy = "it refuses: is NAOqi running? NAOqi 2.9 listens on 9503 (tcps) instead, a Robotino on 80"
        yield False, f"robot at {host}:{number}", remedy
        return
    except OSError as error:
        yield False, f"robot at {host}:{number}", f"{error}; is it switched on, and in this network? Try:  ping {host}"
        return
    yield True, f"robot at {host}:{number} accepts connections", ""
    middle = times[len(times) // 2]
    yield (
        middle < SLOW,
        f"round trip {middle * 1e3:.1f} ms, slowest of {len(times)} {times[-1] * 1e3:.1f} ms",
        "too slow to drive well: use a cable or 5 GHz, or see docs/remote.md",
    )
    yield from towards(host, number)
    if number in WEB_PORTS:
        yield from robot_clock(host, number)
    print("    On the robot's own computer:  python3 robot_computer.py  (copy it there from telepresence/station)")


def ping(host: str) -> bool:
    """Ask whether the robot's computer is there; driving does not depend on it, because networks may drop pings."""
    program = shutil.which("ping")
    if program is None:
        print("  - ping: not installed here (sudo apt install iputils-ping); going on without it")
        return False
    answer = subprocess.run([program, "-c", "3", "-W", "2", host], capture_output=True, text=True, timeout=30)
    if answer.returncode == 0:
        print(f"  ✓ ping {host}: it answers")
    else:
        reason = (answer.stderr.strip() or answer.stdout.strip()).splitlines()[-1:] or ["no answer"]
        print(f"  - ping {host}: {clean(reason[0])}. Switched off, in another network, or a firewall drops pings")
    return answer.returncode == 0


def ssh(host: str, port: int = SSH_PORT) -> bool:
    """Ask the robot's ssh server for its first line. Driving does not need it, looking after the robot does."""
    try:
        with socket.create_connection((host, port), timeout=SSH_TIMEOUT) as connection:
            first = connection.recv(256).decode(errors="replace").partition("\n")[0].strip()
        if first.startswith("SSH-"):
            print(f"  ✓ ssh {host}: {clean(first)}")
            return True
        reason = f"something else answers on port {port}" if first else "it hangs up at once"
    except ConnectionRefusedError:
        reason = "no ssh server runs there (on the robot:  sudo systemctl enable --now ssh)"
    except OSError as error:
        reason = f"{error.strerror or error}. ssh sometimes needs a nudge:  ping {host}  and try again"
    print(f"  - ssh {host}: {reason}. If it stays so, attach a display and a keyboard to the robot: docs/remote.md, 4")
    return False


def connect_time(host: str, port: int) -> float:
    """Return the seconds that opening a connection takes: one round trip. Raises OSError."""
    begin = time.monotonic()
    socket.create_connection((host, port), timeout=3.0).close()
    return time.monotonic() - begin


def towards(host: str, port: int) -> Iterator[Finding]:
    """Say which of our addresses the robot sees, and whether ROS nodes elsewhere could call back to ROS_IP."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect((host, port))  # a datagram socket sends nothing yet
        ours = probe.getsockname()[0]
    announced = os.environ.get("ROS_IP") or os.environ.get("ROS_HOSTNAME") or ""
    local = ours.startswith("127.")
    if in_image() and not local:
        print(f"  - a container: if the host is not {ours}, ROS nodes elsewhere need  --network host  (Linux)")
    what = f"this machine is {ours} to the robot" + (f", and ROS_IP is {announced}" if announced else "")
    yield True, what, ""
    if not local and not in_image() and announced.startswith(("127.", "localhost")):
        print(
            "  - ROS stays on this machine, as it should where all nodes run here. For nodes elsewhere: docs/remote.md"
        )


def robot_clock(host: str, port: int) -> Iterator[Finding]:
    """Check the robot's clock by the date in its web server's answer (whole seconds)."""
    connection = BoundedConnection(host, port, WEB_TIMEOUT)
    try:
        answer = connection.exchange("GET", "/", None, {}, time.monotonic() + WEB_TIMEOUT, LARGEST_PAGE)
    except (OSError, BadAnswer) as error:
        yield False, f"web server at {host}:{port}", f"{error}; a Robotino answers there: is its restapid running?"
        return
    finally:
        connection.close()
    if date := answer.headers.get("Date"):
        try:
            ahead = email.utils.parsedate_to_datetime(date).timestamp() - time.time()
        except (ValueError, OverflowError):
            yield False, f"web server at {host}:{port}: its date is {clean(date)}", "is it a Robotino's?"
            return
        yield abs(ahead) < WRONG_CLOCK, f"robot's clock: {ahead:+.0f} s", "set it: pictures and commands carry times"


if __name__ == "__main__":
    sys.exit(main())
