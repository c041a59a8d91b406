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
import textwrap
import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from telepresence.security.private_files import restrict_new_files
from telepresence.station import (
    health,
    heartbeat,
    processes,
    start_conditions,
    station_folder,
    takeover,
    vitals,
)
from telepresence.station.absence import goes_on, name_owner
from telepresence.station.announcement import (
    FIRST_PICTURE,
    NO_SOUND,
    banner,
    next_steps,
)
from telepresence.station.faults import SOCKET as FAULTS
from telepresence.station.faults import FaultReporter
from telepresence.station.kept_program import KeptProgram
from telepresence.station.launch_settings import (
    LAUNCH,
    OWN_SETTINGS,
    STATIONS,
    described_arguments,
    launch_arguments,
)
from telepresence.station.log_folder import OUTPUTS, log_folder
from telepresence.station.master_keeper import MasterKeeper
from telepresence.station.pilot_page import SITE
from telepresence.station.plan import Plan, named, prepare
from telepresence.station.program_on_demand import ProgramOnDemand
from telepresence.station.program_output import ProgramOutput
from telepresence.station.ros_master import master_answers
from telepresence.station.screen import Screen
from telepresence.station.station_folder import StationFolder
from telepresence.station.takeover import Left
from telepresence.station.terminal_printer import TerminalPrinter
from telepresence.station.unprivileged import STAY, must_leave_root
from telepresence.station.virtual_display import display_answers
from telepresence.station.vitals import Beats
from telepresence.stop_signals import stop_on
from telepresence.switch import is_on

WINDOWLESS = ("gui", "teleop")
"""Settings that are false for a robot's unit, which nobody sits at."""
LAUNCH_TIMEOUTS = ("--sigint-timeout=5", "--sigterm-timeout=2")


def main(argv: list[str] | None = None) -> int:
    arguments = parse(sys.argv[1:] if argv is None else argv)
    if must_leave_root():
        print(f"stack up: not as root: run ./stack up, which becomes another user, or set {STAY}=1", file=sys.stderr)
        return 1
    environment = dict(os.environ)
    stop = threading.Event()
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    processes.adopt_orphans()
    restrict_new_files()  # logs, in which stands what was said, too
    folder = None
    try:
        master = os.environ.get("ROS_MASTER_URI", takeover.MASTER_URI)
        left = takeover.find(named(arguments), master)
        spared = takeover.spared(left, master)
        for found in station_folder.sweep(spared):
            print(f"Left by a station that was killed, and ended or removed now: {found}", file=sys.stderr)
        if left is not None:
            folder = left.take()
        else:
            start_conditions.require_room()
            folder = StationFolder(spared=spared)
        name_owner(folder.path)
        start_conditions.say_all(
            start_conditions.raise_descriptor_limit(), start_conditions.choose_log_folder(folder.path / "log")
        )
        return run(prepare(arguments, left), stop, environment, left)
    except (RuntimeError, OSError) as error:
        with contextlib.suppress(OSError):  # who has closed the terminal reads nothing any more
            print(f"stack up: {error}", file=sys.stderr, flush=True)
        return 1
    finally:
        processes.end_descendants()
        if folder is not None:
            station_folder.end_programs(lambda place: place == folder.path)  # which an earlier ./stack up has started
            folder.close()


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the robot and the launch arguments.

    Raises:
        SystemExit: With a usage line, for an unknown robot or an argument that is not name:=value.
    """
    is_unit = "--unit" in argv
    robots = sorted(STATIONS if is_unit else [path.stem for path in LAUNCH.glob("*.launch")])
    parser = argparse.ArgumentParser(
        prog="./stack unit" if is_unit else "./stack up",
        description="Bring up a robot, real or simulated, with everything that drives it; a unit has no window.",
        epilog=_settings_help(next((word for word in argv if word in robots), "pepper")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
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
        # Its own microphone and camera stand beside the robot; pilots bring theirs by the page.
        found.settings.setdefault("conversation", "false")
    return found


def _settings_help(robot: str) -> str:
    """What each name:=value is for, as paragraphs of a help text."""
    purposes = described_arguments(robot) | OWN_SETTINGS
    paragraphs = [
        textwrap.fill(f"{name:<21} {purpose}", 100, initial_indent="  ", subsequent_indent=" " * 24)
        for name, purpose in purposes.items()
    ]
    return "\n".join([f"name:=value of {robot} (others: name the robot before --help):", *paragraphs])


def run(plan: Plan, stop: threading.Event, environment: dict[str, str], left: Left | None = None) -> int:
    """Bring everything up and wait until `stop` is set or roslaunch ends.

    Args:
        environment: What this process was started with.
        left: A station that goes on, to be taken over.
    Raises:
        RuntimeError: A part does not start; the text says which and what to do.
    """
    folder = Path(os.environ[station_folder.VARIABLE])
    watch = folder / "watch"
    watch.mkdir(mode=0o700, exist_ok=left is not None)
    faults = FaultReporter(watch / FAULTS)
    printed = left.printed() if left is not None else (None, None)
    output, errors = (
        ProgramOutput(
            log_folder() / f"stack_up-{os.getpid()}{ending}", folder / f"read{ending}" if goes_on() else None, there
        )
        for ending, there in zip(OUTPUTS, printed, strict=True)
    )
    with contextlib.ExitStack() as ends:
        printer = ends.enter_context(TerminalPrinter(output.path.parent))
        link = ""
        if plan.page is not None:
            ends.callback(plan.page.close)
            link = plan.page.open() if left is None else plan.page.keep(left.link, left.invitation)
        terminal = Terminal(output, errors, printer, plan, link)
        ends.callback(terminal.close)
        screen = None
        display = Path(left.display) if left is not None and left.display else None
        if plan.window and (display or not display_answers(os.environ.get("DISPLAY"))):
            screen = Screen(plan.settings, faults.report, folder, display)
            ends.callback(screen.close)
        # roslaunch reads its files while roscore starts.
        beats = Beats(watch / "roslaunch")
        beats.ready = left is not None
        start = partial(start_roslaunch, plan.robot, plan.settings, watch, beats, output, errors)
        launch = KeptProgram(
            "roslaunch",
            takeover.noted(folder, takeover.ROSLAUNCH, start, takeover.adopted(folder, takeover.ROSLAUNCH)),
            faults.report,
            beats,
            ended=lambda code: ended_for_good(code, beats.ready),
        )
        keeper = None
        if left is not None or not uses_running_master(plan.master_uri, printer, stop):
            keeper = MasterKeeper(plan.master_uri, watch, faults.report, folder)
            ends.callback(keeper.close)
            if left is not None and not keeper.adopted:
                takeover.kill(folder, takeover.ROSLAUNCH)  # the next one gives the new master its parameters
        health.note(folder, plan.master_uri, plan.page.url if plan.page is not None else "", plan.stations)
        if left is not None:
            printer.say("This station went on without a ./stack up that has died, and is taken over by this one.")
        if SITE not in os.environ:  # else the links' keys would be in a log
            printer.say(banner(plan.robot, plan.settings, plan.master_uri, plan.simulated, screen, link, output.path))
        if keeper is not None and goes_on():
            invitation = plan.page.invitation if plan.page is not None else ""
            place = str(screen.folder) if screen is not None else ""
            added = takeover.added(environment)
            keep = Left(str(folder), plan.master_uri, plan.named, added, link, invitation, place).save
        else:
            keep = nothing
        heartbeat.notify("READY=1")
        programs = Programs(launch, beats, screen.programs if screen is not None else (), keeper)
        return programs.supervise(terminal, faults, printer, stop, keep)


def nothing() -> None:
    """Where nobody takes a station over."""


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
        self,
        terminal: Terminal,
        faults: FaultReporter,
        printer: TerminalPrinter,
        stop: threading.Event,
        keep: Callable[[], None],
    ) -> int:
        """Start again what dies or freezes, until `stop` is set or roslaunch ends; return the exit code.

        Args:
            keep: Called once, when every node was started: from then on the station can be taken over.
        """
        looked, kept = time.monotonic(), False
        while not stop.wait(vitals.PERIOD):
            heartbeat.beat()
            elapsed, looked = time.monotonic() - looked, time.monotonic()
            code = self.launch.poll(elapsed)
            terminal.poll(self.beats.ready)
            if self.beats.ready and not kept:
                kept = True
                keep()
            if code is not None:
                printer.warn("roslaunch ended")
                return code or 1
            for program in self.screen:
                program.poll(elapsed)
            faults.flush()
            children = (self.launch, *self.screen, self.keeper)
            processes.reap_orphans({program.pid for program in children if program is not None})
        heartbeat.notify("STOPPING=1")
        takeover.forget(Path(os.environ[station_folder.VARIABLE]))
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
        keyboard = "teleop" in launch_arguments(self._plan.robot) and is_on(self._plan.settings, "teleop")
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
    command = [sys.executable, "-P", "-m", "telepresence_ros.roslaunch", "--wait", *LAUNCH_TIMEOUTS]
    chosen = [f"{name}:={value}" for name, value in settings.items() if name not in OWN_SETTINGS]
    return processes.start(
        [*command, str(LAUNCH / f"{robot}.launch"), *chosen],
        tied=not goes_on(),
        stdout=output.descriptor,
        stderr=errors.descriptor,
        env={**os.environ, "NOTIFY_SOCKET": str(beats.path), "TELEPRESENCE_WATCH": str(watch)},
    )
