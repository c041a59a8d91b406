"""Which programs a supervisor has started, in files: one that is started in its place adopts them. Standard library
only, and the folder is the station's own, which nobody else can enter."""

from __future__ import annotations

import contextlib
import json
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path

from telepresence.security import private_files
from telepresence.station import vitals


@dataclass(frozen=True)
class Running:
    """A program that was started.

    Args:
        name: The node's name.
        pid, start: Its process and when that started (`vitals.start_time`).
        arguments: Its command line.
        beater: The process that beats for it; 0 if it never did.
    """

    name: str
    pid: int
    start: int
    arguments: list[str]
    beater: int = 0

    @property
    def lives(self) -> bool:
        """Whether that very process still runs."""
        return self.start != 0 and vitals.start_time(self.pid) == self.start


def file_of(folder: Path, name: str, ending: str) -> Path:
    """A file for a program; short, as the path of a unix socket may have 107 bytes only."""
    return folder / f"{zlib.crc32(name.encode()):08x}.{ending}"


def remember(folder: Path, program: Running) -> None:
    """Write it down. A disk that is full only costs the adoption.

    Never wait for the disk: a supervisor that does cannot say that it works, counts as frozen and is killed, and the
    program just started is not known to the next one. What runs outlives no loss of power anyway.
    """
    with contextlib.suppress(OSError):
        private_files.write(file_of(folder, program.name, "json"), json.dumps(asdict(program)).encode())


def recall(folder: Path, name: str) -> Running | None:
    """What was written down of a program, whether it still runs or not."""
    try:
        return Running(**json.loads(file_of(folder, name, "json").read_bytes()))
    except (OSError, ValueError, TypeError):  # nothing, or the disk was full
        return None


def everything(folder: Path) -> list[Running]:
    """All that was written down."""
    found = []
    for path in folder.glob("*.json"):
        with contextlib.suppress(OSError, ValueError, TypeError):
            found.append(Running(**json.loads(path.read_bytes())))
    return found
