"""`./stack up`: robots, real or simulated, with drivers, tablet page, the operator's window and the pilot's page.

Starts roscore (and restarts it when it dies), a virtual display where there is no real one, and roslaunch with the
launch file of the robot. Ctrl-C ends all of it. No process is left behind, even if this program is killed.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from telepresence import ports, start_patience
from telepresence.security.private_files import restrict_new_files
from telepresence.station import container_image, health, heartbeat, processes, start_conditions, station_folder, vitals
from telepresence.station.announcement import (
    FIRST_PICTURE,
    NO_SOUND,
    PAGE_KEY,
    ROBOT_PAGE_KEY,
    banner,
    next_steps,
    pepper_links,
)
from telepresence.station.faults import SOCKET as FAULTS
from telepresence.station.faults import FaultReporter
from telepresence.station.kept_program import KeptProgram
from telepresence.station.launch_settings import (
    LAUNCH,
    OWN_SETTINGS,
    STATIONS,
    launch_arguments,
    port_setting,
    require_free,
    require_known,
    require_ports,
)
from telepresence.station.log_folder import OUTPUTS, LogKeeper, log_folder
from telepresence.station.master_keeper import MasterKeeper
from telepresence.station.pilot_page import SITE, OwnPage
from telepresence.station.program_on_demand import ProgramOnDemand
from telepresence.station.program_output import ProgramOutput
from telepresence.station.ros_master import master_answers
from telepresence.station.screen import SCREEN_KEY, Screen
from telepresence.station.station_folder import StationFolder
from telepresence.station.terminal_printer import TerminalPrinter
from telepresence.station.unprivileged import STAY, must_leave_root
from telepresence.station.virtual_display import display_answers
from telepresence.station.vitals import Beats
from telepresence.stop_signals import stop_on
from telepresence.switch import is_on
from telepresence.web.page_auth import ANNOUNCED, page_key

HEAP = {"MALLOC_ARENA_MAX": "2"}
"""How each program asks for memory (mallopt(3)): with a heap for each of their dozens of threads, what one thread has
given back lies idle while another one asks for more."""
OWN_DISTUTILS = {"SETUPTOOLS_USE_DISTUTILS": "stdlib"} if sys.version_info < (3, 12) else {}
"""Debian's roslaunch asks distutils for one function. Setuptools takes its place, while there is one: 13 MB and
0.1 s for every roslaunch."""
WINDOWLESS = ("gui", "teleop")
"""Settings that are false for a robot's unit, which nobody sits at."""
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
        return run(prepare(arguments), stop)
    except (RuntimeError, OSError) as error:
        with contextlib.suppress(OSError):  # who has closed the terminal reads nothing any more
            print(f"stack up: {error}", file=sys.stderr, flush=True)
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
        prog="./stack unit" if "--unit" in argv else "./stack up",
        description="Bring up a robot, real or simulated, with everything that drives it; a unit has no window.",
        epilog="Launch arguments and their defaults:  ./stack exec roslaunch --ros-args launch/pepper.launch",
    )
    parser.add_argument("robot", nargs="?", default="pepper", help=f"one of: {', '.join(robots)}; default pepper")
    parser.add_argument("settings", nargs="*", metavar="name:=value", help="arguments for the launch file")
    parser.add_argument("--unit", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--verbose", action="store_true", help="show here, too, what the programs print")
    found = parser.parse_intermixed_args(argv)
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
    if found.unit:
        known = launch_arguments(found.robot)
        for name in (each for each in WINDOWLESS if each in known):
            if found.settings.setdefault(name, "false").lower() not in ("false", "0"):
                parser.error(f"a unit has neither window nor terminal: no {name}:={found.settings[name]}")
    return found


@dataclass(frozen=True)
class Plan:
    """What is to run."""

    robot: str
    settings: dict[str, str]
    simulated: bool
    window: bool
    """There is the operator's window."""
    page: OwnPage | None
    master_uri: str
    verbose: bool

    @property
    def stations(self) -> int:
        """Robots of this launch file that one can drive."""
        return len(STATIONS.get(self.robot, ()))


def prepare(arguments: argparse.Namespace) -> Plan:
    """Look whether everything can be, and set the environment of all programs.

    Raises:
        RuntimeError: A port is taken, or something else is missing; the text says which and what to do.
    """
    robot, settings = arguments.robot, arguments.settings
    if container_image.in_image():
        container_image.make_x_sockets()
        if "page" in launch_arguments(robot):
            settings = container_image.page_settings(settings)
    simulated = is_on(settings, "sim")
    require_known(robot, settings)
    set_ros_address()
    LogKeeper().start()
    start_conditions.require_protection(settings.get("firewall"))
    require_ports(robot, settings, simulated)
    page = own_page(robot, settings, simulated)
    master_uri = os.environ.setdefault("ROS_MASTER_URI", "http://localhost:11311")
    start_conditions.require_no_station(master_uri)
    set_environment(robot, settings, simulated)
    window = "gui" in launch_arguments(robot) and is_on(settings, "gui")
    return Plan(robot, settings, simulated, window, page, master_uri, arguments.verbose)


def run(plan: Plan, stop: threading.Event) -> int:
    """Bring everything up and wait until `stop` is set or roslaunch ends.

    Raises:
        RuntimeError: A part does not start; the text says which and what to do.
    """
    folder = Path(os.environ[station_folder.VARIABLE])
    watch = folder / "watch"
    watch.mkdir(mode=0o700)
    faults = FaultReporter(watch / FAULTS)
    output, errors = (ProgramOutput(log_folder() / f"stack_up-{os.getpid()}{ending}") for ending in OUTPUTS)
    with contextlib.ExitStack() as ends:
        printer = ends.enter_context(TerminalPrinter(output.path.parent))
        link = ""
        if plan.page is not None:
            ends.callback(plan.page.close)
            link = plan.page.open()
        terminal = Terminal(output, errors, printer, plan, link)
        ends.callback(terminal.close)
        screen = None
        if plan.window and not display_answers(os.environ.get("DISPLAY")):
            screen = Screen(plan.settings, faults.report)
            ends.callback(screen.close)
        # roslaunch reads its files while roscore starts.
        beats = Beats(watch / "roslaunch")
        launch = KeptProgram(
            "roslaunch",
            partial(start_roslaunch, plan.robot, plan.settings, watch, beats, output, errors),
            faults.report,
            beats,
            ended=lambda code: ended_for_good(code, beats.ready),
        )
        keeper = None
        if not uses_running_master(plan.master_uri, printer, stop):
            keeper = MasterKeeper(plan.master_uri, watch, faults.report)
            ends.callback(keeper.close)
        health.note(folder, plan.master_uri, plan.page.url if plan.page is not None else "", plan.stations)
        if SITE not in os.environ:  # else the links' keys would be in a log
            printer.say(banner(plan.robot, plan.settings, plan.master_uri, plan.simulated, screen, link, output.path))
        heartbeat.notify("READY=1")
        programs = Programs(launch, beats, screen.programs if screen is not None else (), keeper)
        return programs.supervise(terminal, faults, printer, stop)


class Programs(NamedTuple):
    """What `./stack up` has started itself.

    Args:
        launch, beats: roslaunch, and its signs of life.
        screen: The programs of the virtual display.
        keeper: Keeps the ROS master; None where somebody else has started one.
    """

    launch: KeptProgram
    beats: Beats
    screen: Sequence[KeptProgram | ProgramOnDemand]
    keeper: MasterKeeper | None

    def supervise(
        self, terminal: Terminal, faults: FaultReporter, printer: TerminalPrinter, stop: threading.Event
    ) -> int:
        """Start again what dies or freezes, until `stop` is set or roslaunch ends; return the exit code."""
        looked = time.monotonic()
        while not stop.wait(vitals.PERIOD):
            heartbeat.beat()
            elapsed, looked = time.monotonic() - looked, time.monotonic()
            code = self.launch.poll(elapsed)
            terminal.poll(self.beats.ready)
            if code is not None:
                printer.warn("roslaunch ended")
                return code or 1
            for program in self.screen:
                program.poll(elapsed)
            faults.flush()
            children = (self.launch, *self.screen, self.keeper)
            processes.reap_orphans({program.pid for program in children if program is not None})
        heartbeat.notify("STOPPING=1")
        printer.say("\nEnding everything ...")
        self.launch.close(patience=8.0)
        return 0


def uses_running_master(uri: str, printer: TerminalPrinter, stop: threading.Event) -> bool:
    """Return whether a ROS master runs there already, and say what follows from that.

    Raises:
        RuntimeError: It is none that a station can use.
    """
    if not master_answers(uri, timeout=1.0):
        return False
    start_conditions.require_roscore(uri, stop)
    printer.say(f"Using the ROS master that runs at {uri}")
    if exposure := start_conditions.exposure(uri):
        printer.say(exposure)
    return True


def own_page(robot: str, settings: dict[str, str], simulated: bool) -> OwnPage | None:
    """Return the pilot's page of this station; None where the launch file has none.

    Raises:
        RuntimeError: What was asked for cannot be; its port is taken.
    """
    if robot not in STATIONS:
        return None
    page = OwnPage(settings, simulated)
    if page.address is not None and not page.socket:
        port = port_setting(settings, "pilot_page_port", ports.PILOT_PAGE)
        require_free(port, "pilot_page_port", "the pilot's page", address=page.address)
    return page


def set_ros_address() -> None:
    """Let ROS announce and use loopback, unless a person has said otherwise: without any address it announces the name
    of the host and listens everywhere."""
    if not (os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP")):
        os.environ["ROS_IP"] = "127.0.0.1"


def set_environment(robot: str, settings: dict[str, str], simulated: bool) -> None:
    """Set what all programs of the station find in their environment."""
    for name, value in (HEAP | OWN_DISTUTILS).items():
        os.environ.setdefault(name, value)
    for variable in (PAGE_KEY, SCREEN_KEY, ROBOT_PAGE_KEY):
        os.environ[variable] = page_key(variable)
    if simulated:
        os.environ.setdefault(start_patience.VARIABLE, str(start_patience.PATIENCE_WITH_SIMULATION))
    os.environ[ANNOUNCED] = " ".join(pepper_links(robot, settings, simulated))


class Terminal:
    """What the programs print, as far as it goes to the terminal.

    Args:
        output, errors: Of the programs.
        printer: Has the terminal.
        plan: What runs: all of the output is shown if it says so, and a window's first picture is waited for.
        link: Opens the pilot's page; empty where there is none.
    """

    def __init__(
        self, output: ProgramOutput, errors: ProgramOutput, printer: TerminalPrinter, plan: Plan, link: str
    ) -> None:
        self._output, self._errors, self._printer, self._plan, self._link = output, errors, printer, plan, link
        self._works, self._sound = False, True

    def poll(self, started: bool) -> None:
        """Show what is new, and once that everything works.

        Args:
            started: Whether every program was started.
        """
        for line in self._errors.lines():
            self._printer.warn(line)
        for line in self._output.lines():
            self._sound = self._sound and NO_SOUND not in line
            if FIRST_PICTURE in line and self._plan.window and not self._works:
                self._say_what_next()
            elif self._plan.verbose:
                self._printer.say(line)
        if started and not self._plan.window and not self._works:
            self._say_what_next()

    def close(self) -> None:
        """Show the rest."""
        self.poll(False)
        self._output.close()
        self._errors.close()

    def _say_what_next(self) -> None:
        self._works = True
        keyboard = is_on(self._plan.settings, "teleop")
        self._printer.say(next_steps(self._plan.window, self._link, self._sound, keyboard))


def ended_for_good(code: int, started: bool) -> bool:
    """Whether roslaunch shall stay away: somebody asked it to end, or it could not start the nodes and has said why.

    Args:
        code: Its exit code; negative: the signal that ended it.
        started: Every node was started once. Who goes on with them afterwards may fail only because the master dies
            meanwhile, and is started again.
    """
    return code == 0 or (code > 0 and not started)


def start_roslaunch(
    robot: str, settings: dict[str, str], watch: Path, beats: Beats, output: ProgramOutput, errors: ProgramOutput
) -> subprocess.Popen:
    """Start roslaunch with the launch file of the robot; it goes on with the nodes of one that was killed."""
    command = [sys.executable, "-m", "telepresence_ros.roslaunch", "--wait", *LAUNCH_TIMEOUTS]
    chosen = [f"{name}:={value}" for name, value in settings.items() if name not in OWN_SETTINGS]
    return processes.start(
        [*command, str(LAUNCH / f"{robot}.launch"), *chosen],
        tied=True,
        stdout=output.descriptor,
        stderr=errors.descriptor,
        env={**os.environ, "NOTIFY_SOCKET": str(beats.path), "TELEPRESENCE_WATCH": str(watch)},
    )
