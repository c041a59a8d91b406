"""Starts and ends child processes so that none is left behind, however they or their parents die.

roslaunch puts every node into a session of its own, so ending roslaunch's process group does not reach them; a
roslaunch that is killed leaves them all. A process that is its descendants' reaper (Linux `PR_SET_CHILD_SUBREAPER`,
prctl(2)) inherits such orphans and can end them.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import logging
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from telepresence.station.adopted import Adopted

PR_SET_CHILD_SUBREAPER = 36  # linux/prctl.h
_UNLESS_ORPHAN = '[ "$PPID" = "$0" ] && exec "$@"'
"""The parent may have died before it was said what is to happen then."""


def adopt_orphans() -> None:
    """Make this process the parent of every descendant whose own parent dies.

    QEMU's emulation of another processor does not know how, unlike every kernel since Linux 3.4: then a warning is
    logged, and a program whose parent is killed may outlive the station.

    Raises:
        OSError: The kernel refused.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0:
        return
    if ctypes.get_errno() != errno.EINVAL:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER) failed")
    logging.getLogger(__name__).warning("nobody adopts orphans here: this is no Linux kernel but an emulation of one")


def start(argv: Sequence[str], *, tied: bool = False, **popen: Any) -> subprocess.Popen:
    """Start a program in a session of its own: Ctrl-C in our terminal does not reach it, so we choose the order of
    ending. It keeps our terminal as standard input unless `stdin` says otherwise.

    Args:
        tied: The kernel sends it SIGINT when the thread that calls this ends, even if that was killed (prctl(2),
            PR_SET_PDEATHSIG, through util-linux's setpriv: code between fork and exec of a threaded Python may hang).
    Raises:
        FileNotFoundError: There is no such program.
    """
    words = list(argv)
    if tied:
        if shutil.which(words[0]) is None:
            raise FileNotFoundError(f"there is no program {words[0]}")
        words = ["setpriv", "--pdeathsig", "INT", "sh", "-c", _UNLESS_ORPHAN, str(os.getpid()), *words]
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # inherited by a background job of a shell, and passed on
            words = ["env", "--default-signal=INT", *words]
    return subprocess.Popen(words, start_new_session=True, **popen)


def end(process: subprocess.Popen | Adopted, patience: float = 5.0) -> int:
    """End a program by SIGINT, then SIGTERM, then SIGKILL, and return its exit code.

    Args:
        patience: Seconds to wait after each signal.
    """
    for request in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        if process.poll() is not None:
            break
        process.send_signal(request)
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            continue
    return process.wait()


def descendants(root: int | None = None) -> list[int]:
    """Return the process ids of all living descendants of `root` (default: this process), without zombies."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            # The program's name stands in brackets and may hold blanks and brackets itself.
            state, parent = stat.read_text().rpartition(")")[2].split()[:2]
        except OSError:
            continue  # it ended between the listing and the reading
        if state != "Z":
            children.setdefault(int(parent), []).append(int(stat.parent.name))
    found, queue = [], [os.getpid() if root is None else root]
    while queue:
        below = children.get(queue.pop(), [])
        found += below
        queue += below
    return found


def send(pid: int, request: signal.Signals) -> bool:
    """Send a signal; False when the process is gone already."""
    try:
        os.kill(pid, request)
    except ProcessLookupError:
        return False
    return True


def reap_orphans(known: Collection[int]) -> None:
    """Collect the orphans that have ended, so that they do not stay as zombies and whoever watches them sees it.

    Args:
        known: Process ids whose exit codes somebody else asks for.
    """
    with contextlib.suppress(ChildProcessError):
        while ended := os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            if ended.si_pid in known:
                return
            os.waitpid(ended.si_pid, os.WNOHANG)


def end_descendants(patience: float = 3.0) -> list[int]:
    """End every descendant: SIGINT, after `patience` seconds SIGTERM, then SIGKILL.

    Returns:
        The process ids that had to be killed.
    """
    killed: list[int] = []
    for request in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        for pid in descendants():
            if request is signal.SIGKILL:
                killed.append(pid)
            send(pid, request)
        deadline = time.monotonic() + patience
        while descendants() and time.monotonic() < deadline:
            _reap()
            time.sleep(0.02)
    _reap()
    return killed


def _reap() -> None:
    """Collect ended orphans, so that they do not stay as zombies."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return
