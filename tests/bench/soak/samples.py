"""What the programs of a station use: memory, descriptors, threads and processor time, sampled from /proc.

A program keeps its name across restarts: the ROS node's, the module's or the script's. Processes of one name (three
shells) count as one program.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

TICKS = os.sysconf("SC_CLK_TCK")
PAGE_SIZE = os.sysconf("SC_PAGE_SIZE")
INTERPRETER = re.compile(r"python[\d.]*$")


@dataclass(frozen=True)
class Usage:
    """What one program uses.

    Args:
        life: Processes that it consists of, by id and start: a restarted program has another life.
        rss, pss: Resident memory, and its share of what it shares with others [kB].
        cpu: Processor time since its start [s].
    """

    life: str
    rss: int
    pss: int
    descriptors: int
    threads: int
    cpu: float


def program_name(words: Sequence[str]) -> str:
    """Return the name of a program by its command line."""
    for word in words:
        if word.startswith("__log:="):
            return re.sub(r"-\d+$", "", Path(word.removeprefix("__log:=")).stem)
    rest = [*words]
    if INTERPRETER.match(Path(rest[0]).name):
        rest = rest[1:]
        while rest and rest[0].startswith("-") and rest[0] not in ("-m", "-c"):
            rest = rest[1:]
        if rest[:1] == ["-m"] and len(rest) > 1:
            return rest[1]
        if not rest or rest[0] == "-c":
            return "python -c"
    name = Path(rest[0].split(" ")[0].rstrip(":") or "?").name
    return f"{name} {rest[1]}" if name == "robotino_onboard" and len(rest) > 1 else name


def sample(pids: Iterable[int]) -> dict[str, Usage]:
    """Return what each program among these processes uses; those that end meanwhile are left out."""
    found: dict[str, list[Usage]] = {}
    for pid in sorted(pids):
        try:
            words = _command(pid)
            usage = _usage(Path(f"/proc/{pid}"))
        except (FileNotFoundError, ProcessLookupError, PermissionError):
            continue  # it has ended, or is about to: a zombie's memory cannot be read
        if words[0] and usage.rss:
            found.setdefault(program_name(words), []).append(usage)
    return {name: _together(usages) for name, usages in found.items()}


def names(pids: Iterable[int]) -> set[str]:
    """Return the names of the programs that run; quicker than a sample."""
    commands = (_command(pid) for pid in pids)
    return {program_name(words) for words in commands if words[0]}


def _command(pid: int) -> list[str]:
    """The command line; [""] of a process that has ended."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").rstrip("\0").split("\0")
    except (FileNotFoundError, ProcessLookupError):
        return [""]
    # A node that roslaunch has forked shows its words as one.
    return words[0].split() if len(words) == 1 and words[0] else words


def _usage(folder: Path) -> Usage:
    fields = (folder / "stat").read_text().rpartition(")")[2].split()
    pss = next(
        int(line.split()[1]) for line in (folder / "smaps_rollup").read_text().splitlines() if line.startswith("Pss:")
    )
    return Usage(
        life=f"{folder.name}@{fields[19]}",
        rss=int(fields[21]) * PAGE_SIZE // 1024,
        pss=pss,
        descriptors=len(os.listdir(folder / "fd")),
        threads=int(fields[17]),
        cpu=(int(fields[11]) + int(fields[12])) / TICKS,
    )


def _together(usages: Sequence[Usage]) -> Usage:
    return Usage(
        life=" ".join(usage.life for usage in usages),
        rss=sum(usage.rss for usage in usages),
        pss=sum(usage.pss for usage in usages),
        descriptors=sum(usage.descriptors for usage in usages),
        threads=sum(usage.threads for usage in usages),
        cpu=sum(usage.cpu for usage in usages),
    )


class LogReader:
    """Reads on in all files of folders: how much is written into them, and the tracebacks in them.

    Attributes:
        written: Bytes that have come into the files since the beginning, whatever was rotated away.
        tracebacks: (file, last line of the traceback) -> how often.
    """

    MOST_AT_ONCE = 4 << 20
    """Bytes of a file that are searched at a time; what a flood writes beyond is only counted."""

    def __init__(self, *folders: Path) -> None:
        self.folders = folders
        self.written = 0
        self.tracebacks: dict[tuple[str, str], int] = {}
        self._at: dict[int, int] = {}  # inode -> what has been read of it
        self._open: dict[int, bool] = {}  # inode -> a traceback has begun and its last line has not come yet

    def read(self) -> None:
        """Read what is new."""
        for folder in self.folders:
            for path in sorted(folder.rglob("*")):
                try:
                    if path.is_file() and not path.is_symlink():
                        self._read(path)
                except FileNotFoundError:
                    continue  # rotated away meanwhile

    def size(self) -> int:
        """Return the bytes that the files take on the disk."""
        total = 0
        for folder in self.folders:
            for path in folder.rglob("*"):
                try:
                    total += path.lstat().st_blocks * 512
                except FileNotFoundError:
                    continue
        return total

    def _read(self, path: Path) -> None:
        with path.open("rb") as file:
            about = os.fstat(file.fileno())
            begin = self._at.get(about.st_ino, 0)
            if about.st_size < begin:
                begin = 0  # emptied
            self.written += about.st_size - begin
            self._at[about.st_ino] = about.st_size
            file.seek(max(begin, about.st_size - self.MOST_AT_ONCE))
            text = file.read(about.st_size - file.tell()).decode(errors="replace")
        within = self._open.get(about.st_ino, False)
        for line in text.splitlines():
            if "Traceback (most recent call last)" in line:
                within = True
            elif within and line.strip() and not line.startswith((" ", "\t")):
                within = False
                if line.startswith("["):
                    line = "its end is missing"  # a line as long as a traceback may have been shortened
                key = (re.sub(r"-\d+(?=\.log)", "", path.name), line.strip()[:200])
                self.tracebacks[key] = self.tracebacks.get(key, 0) + 1
        self._open[about.st_ino] = within
