"""A station's private folder for temporary files, by which the next start finds what an ended station left behind.

All programs of a station find the folder in TMPDIR and its name in TELEPRESENCE_STATION. Whatever carries the name of a
folder without an owner is left over from a station that was killed: `sweep` ends such programs and removes such files.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from telepresence.station import processes, virtual_display
from telepresence.temporary_folder import TemporaryFolder, owned, ownerless, remove

VARIABLE = "TELEPRESENCE_STATION"
"""Environment variable with the folder's path."""
PREFIX = "telepresence-station-"
PATIENCE = 2.0
"""Seconds that left programs have to end by SIGTERM before they are killed."""
_TERMINALS = "telepresence-*"
"""Names of the sockets of the windows' tmux servers."""


class StationFolder:
    """A new temporary folder that the environment of this process, and of what it starts, names until `close`.

    Args:
        left: That of a station whose owner has died, and which is taken over instead.
        spared: Which of those whose owners have died are not removed.
    Raises:
        OSError: It cannot be made, or taken over.
    """

    def __init__(self, left: Path | None = None, spared: Callable[[Path], bool] = lambda folder: False) -> None:
        self._folder = TemporaryFolder(PREFIX, _remove_displays, left, spared)
        self.path = self._folder.path
        self._before = {name: os.environ.get(name) for name in (VARIABLE, "TMPDIR")}
        os.environ.update({VARIABLE: str(self.path), "TMPDIR": str(self.path)})
        tempfile.tempdir = None  # tempfile reads TMPDIR only once

    @property
    def environment_before(self) -> dict[str, str]:
        """The environment of this process without the folder."""
        others = {name: value for name, value in os.environ.items() if name not in self._before}
        return others | {name: value for name, value in self._before.items() if value is not None}

    def close(self) -> None:
        """Remove the folder with everything in it, and what X servers of this station left elsewhere."""
        for name, value in self._before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
        tempfile.tempdir = None
        self._folder.close()


def sweep(spared: Callable[[Path], bool] = lambda folder: False) -> list[str]:
    """End the programs and remove the files of this user's stations that were killed.

    Args:
        spared: Which of their folders are left alone, with the programs: somebody else takes them over.
    Returns:
        What was found, for the person: the programs' names, then the folders.
    """
    found = [
        f"{name} (process {pid})"
        for pid, name in end_programs(lambda folder: not (owned(folder) or spared(folder))).items()
    ]
    for folder in ownerless(PREFIX):
        if not spared(folder):
            remove(folder, _remove_displays)
            found.append(str(folder))
    for terminal in _terminals():
        if not _answers(terminal):
            with contextlib.suppress(OSError):
                terminal.unlink()
                found.append(str(terminal))
    return found


def _terminals() -> list[Path]:
    """List the sockets of this user's tmux servers; none if their folder, whose name anybody can take, is another
    user's."""
    folder = Path(os.environ.get("TMUX_TMPDIR", "/tmp"), f"tmux-{os.getuid()}")
    try:
        ours = folder.lstat().st_uid == os.getuid()
        return [*folder.glob(_TERMINALS)] if ours else []
    except OSError:
        return []


def belongs(pid: int, folder: Path) -> bool:
    """Whether this process is a program of the station with this folder."""
    return any(process == pid and place == folder for process, place, _ in _programs())


def end_programs(chosen: Callable[[Path], bool]) -> dict[int, str]:
    """End this user's programs of the stations whose folders are chosen, but for this process and those above it.

    Returns:
        Process id -> name of each.
    """
    left = {pid: name for pid, folder, name in _programs() if chosen(folder)}
    for request in (signal.SIGTERM, signal.SIGKILL):
        for pid in left:
            processes.send(pid, request)
        deadline = time.monotonic() + PATIENCE
        while left and {*left} & {pid for pid, _, _ in _programs()} and time.monotonic() < deadline:
            time.sleep(0.02)
    return left


def _programs() -> Iterator[tuple[int, Path, str]]:
    """Yield process id, station folder and name of each of this user's programs that belong to a station.

    Only those that see the same files and processes as we do: in another container the same path is another folder."""
    family = _ancestors()  # a terminal of the dead station, in which the next one is started
    ours = [os.readlink(f"/proc/self/ns/{kind}") for kind in ("mnt", "pid")]
    key = f"{VARIABLE}=".encode()
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if process.stat().st_uid != os.geteuid() or int(process.name) in family:
                continue
            words = (process / "environ").read_bytes().split(b"\0")
            folder = next((word[len(key) :] for word in words if word.startswith(key)), b"")
            # A zombie's environment is empty, and so is that of what runs as somebody else.
            if folder and [os.readlink(process / "ns" / kind) for kind in ("mnt", "pid")] == ours:
                yield int(process.name), Path(os.fsdecode(folder)), (process / "comm").read_text().strip()
        except OSError:
            continue  # it ended between the listing and the reading, or is not ours to look into


def _ancestors() -> set[int]:
    """Return the process ids of this process and of those above it."""
    found, pid = set(), os.getpid()
    while pid > 1:
        found.add(pid)
        pid = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return found


def _remove_displays(folder: Path) -> None:
    """Remove what the virtual displays of a station have elsewhere."""
    for display in folder.glob(f"{virtual_display.PREFIX}*"):
        virtual_display.remove_elsewhere(display)


def _answers(path: Path) -> bool:
    """Whether somebody listens at this socket."""
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(1.0)
        return probe.connect_ex(str(path)) == 0
