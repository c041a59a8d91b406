"""A station that goes on without its `./stack up`, until the next one takes it over.

For a station that systemd keeps, which starts `./stack up` again at once when that dies or freezes: nothing else has
to be started again, and the robot need not even stop. `./stack service` says so in the unit, by VARIABLE. Then
roslaunch with its nodes, the ROS master and the virtual display go on, and what the next `./stack up` has to know of
them is in the station's folder. It starts another roslaunch, which goes on with the nodes. If none comes, roslaunch
and the master end after WAITS, and the next start sweeps the rest.

    python3 -m telepresence.station.takeover     ends such a station instead, see `./stack service`

Standard library only.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from telepresence.security import private_files
from telepresence.station import program_registry, vitals
from telepresence.station.absence import FILE, goes_on
from telepresence.station.adopted import Adopted
from telepresence.station.program_registry import Running
from telepresence.station.station_folder import PREFIX, StationFolder, sweep
from telepresence.temporary_folder import ownerless

MASTER_URI = "http://localhost:11311"
"""Where the ROS master is, unless the environment says otherwise."""
PROGRAMS = "programs"
"""Folder in the station's folder: what `./stack up` has started itself."""
ROSLAUNCH, MASTER = "roslaunch", "rosmaster"
KILL_TIMEOUT = 2.0


@dataclass(frozen=True)
class Left:
    """A station whose `./stack up` has died.

    Args:
        folder: The station's.
        master: Address of its ROS master.
        arguments: What it was started with.
        environment: What its `./stack up` had added to its own: keys, the display, the folder for temporary files.
        link: That opens the pilot's page, as it was shown; empty for none.
        invitation: The one that the link holds; empty for none.
        display: The folder of the virtual display; empty for none.
    """

    folder: str
    master: str
    arguments: list[str]
    environment: dict[str, str]
    link: str
    invitation: str
    display: str

    def take(self) -> StationFolder:
        """Become its owner: its folder and what it had in its environment are those of this process.

        Raises:
            OSError: Somebody else was faster.
        """
        folder = StationFolder(Path(self.folder))
        os.environ.update(self.environment)
        return folder

    def printed(self) -> tuple[int, int]:
        """Where its programs print to: standard output and standard error, which roslaunch has from its `./stack up`.

        Raises:
            OSError: It has ended.
        """
        pid = running(Path(self.folder), ROSLAUNCH)
        out, error = (os.open(f"/proc/{pid}/fd/{number}", os.O_RDWR | os.O_APPEND | os.O_CLOEXEC) for number in (1, 2))
        return out, error

    def save(self) -> None:
        """Write it down for the next `./stack up`; a full disk only costs the takeover."""
        with contextlib.suppress(OSError):
            private_files.write(Path(self.folder, FILE), json.dumps(asdict(self)).encode())


def find(arguments: list[str], master: str) -> Left | None:
    """Return the station that was started with these arguments at this ROS master, and that goes on without its
    `./stack up`; None for none."""
    for folder in ownerless(PREFIX) if goes_on() else ():
        left = read(folder)
        if left is not None and (left.arguments, left.master) == (arguments, master):
            return left
    return None


def read(folder: Path) -> Left | None:
    """Return the station of a folder, if it can be taken over."""
    with contextlib.suppress(OSError, ValueError, TypeError):
        left = Left(**json.loads((folder / FILE).read_bytes()))
        if running(folder, ROSLAUNCH) and running(folder, MASTER):
            return left
    return None


def spared(own: Left | None, master: str) -> Callable[[Path], bool]:
    """Return what says which stations without a `./stack up` a new one leaves alone: that which it takes over itself,
    and those at other masters, which somebody else takes over or which end by themselves. What is left at its own
    master is in its way."""

    def is_spared(folder: Path) -> bool:
        left = read(folder)
        return left is not None and (left == own or left.master != master)

    return is_spared


def forget(folder: Path) -> None:
    """The station ends: nobody takes it over any more."""
    (folder / FILE).unlink(missing_ok=True)


def added(before: Mapping[str, str]) -> dict[str, str]:
    """What the environment of this process has that it had not `before`, or had otherwise."""
    return {name: value for name, value in os.environ.items() if before.get(name) != value}


def running(folder: Path, name: str) -> int:
    """The process id of a program that was noted, if that very process still runs; else 0."""
    found = program_registry.recall(folder / PROGRAMS, name)
    return found.pid if found is not None and found.lives else 0


def note(folder: Path, name: str, pid: int) -> None:
    """Note that a program was started."""
    (folder / PROGRAMS).mkdir(mode=0o700, exist_ok=True)
    program_registry.remember(folder / PROGRAMS, Running(name, pid, vitals.start_time(pid), []))


def noted(
    folder: Path, name: str, start: Callable[[], subprocess.Popen], running: Adopted | None = None
) -> Callable[[], subprocess.Popen | Adopted]:
    """Return what starts a program and notes that; the first time it goes on with the one that runs, if one does."""
    going_on = [running] if running is not None else []

    def start_and_note() -> subprocess.Popen | Adopted:
        process = going_on.pop() if going_on else start()
        note(folder, name, process.pid)
        return process

    return start_and_note


def adopted(folder: Path, name: str) -> Adopted | None:
    """The program that was noted, if it runs."""
    if pid := running(folder, name):
        with contextlib.suppress(ProcessLookupError):
            return Adopted(pid)
    return None


def kill(folder: Path, name: str) -> None:
    """End a program that was noted, at once: another one takes its place."""
    if (program := adopted(folder, name)) is not None:
        program.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(KILL_TIMEOUT)


def main() -> int:
    """End what a `./stack up` at this ROS master has left, which systemd has stopped or given up: there is no next."""
    sweep(spared(None, os.environ.get("ROS_MASTER_URI", MASTER_URI)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
