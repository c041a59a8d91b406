"""Keeps the folder of ROS's logs small: old runs are deleted, and files that nobody rotates are cut.

    python -m telepresence.station.log_folder       delete old runs now

Python programs rotate their own logs (python_logging.conf), and so does `rosout`. What a node prints goes to a file
that roslaunch opens once and never looks at again; and every run leaves a folder. A run of a station that is still
running is never deleted: its files are open.
"""

from __future__ import annotations

import contextlib
import fcntl
import logging
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

log = logging.getLogger(__name__)

RUNS, LOOSE_FILES = 20, 100
"""Folders of runs, and logs of programs outside any run, that are kept: the newest."""
MOST = 300_000_000
"""Bytes of all of them together, except for what is still open."""
LARGEST_OUTPUT, KEPT_OUTPUT = 4_000_000, 1_000_000
"""A file with what a program prints is cut when it takes more bytes than the first; of its end the second is kept."""
OUTPUTS = ("-stdout.log", "-stderr.log")
CUT_PERIOD, TIDY_PERIOD = 1.0, 600.0
"""Seconds between two looks at the files of running programs, and at the old ones."""


class _Entry(NamedTuple):
    changed: float
    size: int
    path: Path


class LogKeeper:
    """Looks after folders of logs on a thread of its own, until `close`.

    Args:
        folders: None for the one in which ROS logs.
        deletes: Whether the logs of old runs are deleted, too.
    """

    def __init__(self, *folders: Path, deletes: bool = True) -> None:
        self._folders = folders or (log_folder(),)
        self._deletes = deletes
        self._untidy: set[tuple[str, Path]] = set()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="log-keeper", daemon=True)

    def start(self) -> LogKeeper:
        self._thread.start()
        return self

    def close(self) -> None:
        self._stop.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        due = 0.0
        while True:
            for folder in self._folders:
                self._tidy(folder, cut_outputs)
            if self._deletes and time.monotonic() >= due:
                due = time.monotonic() + TIDY_PERIOD
                for folder in self._folders:
                    self._tidy(folder, delete_old)
            if self._stop.wait(CUT_PERIOD):
                return

    def _tidy(self, folder: Path, how: Callable[[Path], object]) -> None:
        """Tidy a folder; of one where that fails a line is logged, and the next one when it has worked meanwhile."""
        what = how.__name__, folder
        try:
            how(folder)
            self._untidy.discard(what)
        except OSError as error:  # a disk that is full or gone must not end the station
            if what not in self._untidy:
                log.warning("logs in %s are not tidied: %s", folder, error)
            self._untidy.add(what)


def log_folder() -> Path:
    """Return the folder in which ROS logs, by the environment, as rospkg does."""
    home = os.environ.get("ROS_HOME") or "~/.ros"
    return Path(os.environ.get("ROS_LOG_DIR") or f"{home}/log").expanduser()


def delete_old(folder: Path) -> list[Path]:
    """Delete the logs of old runs, and return what is gone.

    Raises:
        OSError: The folder cannot be read; files that cannot be deleted stay.
    """
    if not folder.is_dir():
        return []
    in_use = set(_open_files(folder))
    gone: list[Path] = []
    total = 0
    count = {True: 0, False: 0}
    for entry in sorted(_entries(folder), reverse=True):
        is_run = entry.path.is_dir()
        if any(path == entry.path or entry.path in path.parents for path in in_use):
            continue
        total += entry.size
        count[is_run] += 1
        if total > MOST or count[is_run] > (RUNS if is_run else LOOSE_FILES):
            with contextlib.suppress(OSError):
                shutil.rmtree(entry.path) if is_run else entry.path.unlink()
                gone.append(entry.path)
    return gone


def cut_outputs(folder: Path) -> None:
    """Cut each file with what a program prints that has become too large; its end is kept beside it, as NAME.1.

    A program that goes on writing where it was leaves a hole, which takes no room: so blocks count and not the length.

    Raises:
        OSError: One of them cannot be cut, or its end cannot be kept; all others are cut.
    """
    failed = None
    for path in [path for place in ("*.log", "*/*.log") for path in folder.glob(place) if path.name.endswith(OUTPUTS)]:
        try:
            _cut(path)
        except FileNotFoundError:
            continue  # another station's keeper has deleted it
        except OSError as error:
            failed = error
    if failed is not None:
        raise failed


def _cut(path: Path) -> None:
    if path.is_symlink() or path.stat().st_blocks * 512 <= LARGEST_OUTPUT:
        return
    with path.open("rb+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # a site and its unit cut the same file
        if os.fstat(file.fileno()).st_blocks * 512 <= LARGEST_OUTPUT:
            return
        file.seek(-KEPT_OUTPUT, os.SEEK_END)
        end = file.read(KEPT_OUTPUT)
        file.truncate(0)  # first: on a full disk its end finds room only then
        with open(os.open(f"{path}.1", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as kept:
            kept.write(end)


def _entries(folder: Path) -> Iterator[_Entry]:
    """What lies in the folder: runs, and single logs; not links, such as `latest`."""
    for path in folder.iterdir():
        if path.is_symlink():
            continue
        with contextlib.suppress(FileNotFoundError):
            status = [each.lstat() for each in ([path, *path.rglob("*")] if path.is_dir() else [path])]
            yield _Entry(max(each.st_mtime for each in status), sum(each.st_blocks * 512 for each in status), path)


def _open_files(folder: Path) -> Iterator[Path]:
    """Files below the folder that any program has open: ours all, those of other users are not seen."""
    below = f"{folder.resolve()}/"
    for descriptors in Path("/proc").glob("[0-9]*/fd"):
        with contextlib.suppress(OSError):  # it has ended, or is another user's
            for name in os.listdir(descriptors):
                with contextlib.suppress(OSError):
                    target = os.readlink(descriptors / name)
                    if target.startswith(below):
                        yield folder / target.removeprefix(below)


if __name__ == "__main__":
    print(*(f"deleted {path}" for path in delete_old(log_folder())), sep="\n")
    sys.exit(0)
