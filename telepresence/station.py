"""`./stack up`: one robot, real or simulated, with drivers, tablet page, teleoperation and the operator's window.

Starts roscore (and brings it back when it dies), a virtual display where there is no real one, and roslaunch with the
launch file of the robot. Ctrl-C ends all of it, and nothing stays behind.
"""

from __future__ import annotations

import argparse
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType

from telepresence import processes
from telepresence.master_keeper import MasterKeeper
from telepresence.ros_master import master_answers
from telepresence.virtual_display import VirtualDisplay, display_answers

LAUNCH = Path(__file__).resolve().parent.parent / "launch"
PAGE_PORT, SCREEN_PORT = 10002, 10003
ROBOTS = {
    "pepper": ("nao_ip", "nao_port", 9559, "tcp"),
    "robotino": ("robotino_ip", "robotino_port", 8080, "http"),
}
"""Robot -> its launch arguments for address and port, the port of the simulated one, and the scheme of its wire."""
LAUNCH_TIMEOUTS = ("--sigint-timeout=5", "--sigterm-timeout=2")


def main(argv: list[str] | None = None) -> int:
    arguments = parse(sys.argv[1:] if argv is None else argv)
    stop = threading.Event()

    def request_stop(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    signal.signal(signal.SIGINT, request_stop)
    signal.signal(signal.SIGTERM, request_stop)
    signal.signal(signal.SIGHUP, request_stop)
    processes.adopt_orphans()
    try:
        return run(arguments, stop)
    except RuntimeError as error:
        print(f"stack up: {error}", file=sys.stderr)
        return 1
    finally:
        processes.end_descendants()


def parse(argv: list[str]) -> argparse.Namespace:
    """The robot and the launch arguments.

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
    window = settings.get("gui", "true").lower() in ("true", "1")
    address_name, port_name, default_port, _ = ROBOTS[arguments.robot]
    if simulated:
        require_loopback(settings, address_name)
        require_free(port_setting(settings, port_name, default_port), port_name, "the simulated robot")
    if arguments.robot == "pepper":
        require_free(port_setting(settings, "page_port", PAGE_PORT), "page_port", "the tablet's page")
    screen_port = port_setting(settings, "screen_port", SCREEN_PORT)

    master_uri = os.environ.setdefault("ROS_MASTER_URI", "http://localhost:11311")
    keeper = screen = display = None
    try:
        if window and not display_answers(os.environ.get("DISPLAY")):
            require_free(screen_port, "screen_port", "the picture of the window")
            display = VirtualDisplay()
            os.environ["DISPLAY"] = display.name
            screen = serve_screen(display, screen_port)
        # roslaunch reads its files while roscore starts.
        launch = processes.start(
            ["roslaunch", "--wait", *LAUNCH_TIMEOUTS, str(LAUNCH / f"{arguments.robot}.launch")]
            + [f"{name}:={value}" for name, value in settings.items() if name != "screen_port"]
        )
        if master_answers(master_uri, timeout=1.0):
            print(f"Using the ROS master that runs at {master_uri}")
        else:
            keeper = MasterKeeper(master_uri)
        print(banner(arguments.robot, settings, master_uri, simulated, display, screen_port), flush=True)
        while not stop.wait(0.2):
            if launch.poll() is not None:
                print("roslaunch ended", file=sys.stderr)
                return launch.returncode or 1
        print("\nEnding everything ...", flush=True)
        processes.end(launch, patience=8.0)
        return 0
    finally:
        if screen is not None:
            processes.end(screen, patience=2.0)
        if keeper is not None:
            keeper.close()
        if display is not None:
            display.close()


def require_loopback(settings: dict[str, str], name: str) -> None:
    """Raises RuntimeError when the drivers would drive a real robot while a simulated one starts beside it."""
    address = settings.get(name, "127.0.0.1")
    if address not in ("127.0.0.1", "localhost"):
        raise RuntimeError(f"{name}:={address} is no simulated robot: add sim:=false for a real one")


def require_free(port: int, argument: str, purpose: str) -> None:
    """Raises RuntimeError when somebody listens on the loopback port already."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            raise RuntimeError(
                f"port {port}, wanted for {purpose}, is taken: another ./stack up may be running. "
                f"Choose another one with {argument}:=<port>"
            ) from None


def serve_screen(display: VirtualDisplay, port: int) -> subprocess.Popen:
    """A web server for the picture of the display, in a process of its own; looking must not slow driving."""
    return processes.start(
        ["nice", sys.executable, "-m", "telepresence.screen_page", str(display.folder), "--port", str(port)],
        stdout=subprocess.DEVNULL,
    )


def port_setting(settings: dict[str, str], name: str, default: int) -> int:
    """The port that the person chose. Raises RuntimeError when it is none."""
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
    """What runs where, for the person at the terminal."""
    address_name, port_name, default_port, scheme = ROBOTS[robot]
    address, port = settings.get(address_name, "127.0.0.1"), settings.get(port_name, default_port)
    lines = [
        "",
        f"  robot        {robot}, {'simulated' if simulated else 'real'}, {scheme}://{address}:{port}",
        f"  ROS master   {master_uri}",
    ]
    if robot == "pepper":
        lines.append(f"  tablet page  http://127.0.0.1:{settings.get('page_port', PAGE_PORT)}/")
    if display is not None:
        lines += [
            f"  window       http://127.0.0.1:{screen_port}/",
            f"               There is no display here, so the window is on a virtual one ({display.name}).",
        ]
    lines += ["", "  Ctrl-C ends all of it.", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
