"""Whether a running program works, is slow because the machine is busy, or froze: by its beats
(`telepresence.station.heartbeat`) and by what Linux says about its threads (proc(5)). Standard library only.

A stopped program (SIGSTOP) is frozen at once. One that has beaten once and is silent is frozen when it did not use a
processor, wait for one or wait for a disk meanwhile; if it did, it is slow and gets more time. One that has never
beaten is somebody else's: its silence says nothing. One in a debugger is left alone.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import subprocess
from pathlib import Path

from telepresence.station.adopted import UNKNOWN
from telepresence.station.heartbeat import WITHIN

PERIOD = 0.05
"""Seconds between two looks."""
PATIENCE = 2.5
"""Seconds beyond its time that a silent program gets which the machine keeps from working."""
BUSY = 0.1
"""A program works, or would if it could, when its threads ran or waited for a processor for this share of the time."""
LONGEST_STEP = 2 * PERIOD
"""Seconds that one look counts at most: when the watcher itself was kept waiting, so were the beats."""
_SHARE_PERIOD = 0.2
"""Seconds over which that share is measured."""
_QUEUE = 16
"""Datagrams read in one look at most; Linux keeps ten (net.unix.max_dgram_qlen)."""
_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid: unix(7)
_STOPPED, _TRACED = "T", "t"


class Beats:
    """Where one program beats: a unix socket of its own, at a path that goes into its NOTIFY_SOCKET.

    Raises:
        OSError: The path is too long (107 bytes) or cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.ready = False
        """Whether the program has said READY=1."""
        self.stopping = False
        """Whether it has said STOPPING=1: it ends because it was asked to."""
        path.unlink(missing_ok=True)  # left by a watcher that was killed
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
            self._socket.bind(str(path))
        except OSError:
            self._socket.close()
            raise

    def read(self) -> list[tuple[int, float]]:
        """Return who has beaten since the last call (process id), and within how many seconds the next beat is due."""
        found = []
        for _ in range(_QUEUE):
            try:
                message, ancillary, _, _ = self._socket.recvmsg(512, socket.CMSG_SPACE(_CREDENTIALS.size))
            except BlockingIOError:
                break
            words = message.decode("ascii", "replace").split("\n")
            self.ready = self.ready or "READY=1" in words
            self.stopping = self.stopping or "STOPPING=1" in words
            if "WATCHDOG=1" in words and ancillary:
                found.append((_CREDENTIALS.unpack(ancillary[0][2])[0], _within(words)))
        return found

    def close(self) -> None:
        self._socket.close()
        self.path.unlink(missing_ok=True)


class Vitals:
    """Judges one running program.

    Args:
        pid: Its process.
        beats: Where it beats, or None: then only whether it is stopped counts.
        beater: Who is known to have beaten: the program, or what it runs (a node in an xterm); 0: nobody yet.
    """

    def __init__(self, pid: int, beats: Beats | None, beater: int = 0) -> None:
        self.pid = pid
        self._beats = beats
        self._beater = beater
        self._within = WITHIN
        self._silence = 0.0
        self._worked = -1.0  # as of `_measured` seconds of silence; -1: not known
        self._measured = 0.0
        self._busy = False

    @property
    def beater(self) -> int:
        """The process that beats; 0 before the first beat."""
        return self._beater

    def froze(self, elapsed: float) -> bool:
        """Look once; return whether the program is frozen.

        Args:
            elapsed: Seconds since the last look.
        """
        self._read()
        states = [state(self.pid)] + ([state(self._beater)] if self._beater not in (0, self.pid) else [])
        if _TRACED in states:
            self._silence = 0.0
            return False
        if _STOPPED in states:
            return True
        if not self._beater:
            return False
        self._silence += min(elapsed, LONGEST_STEP)
        if self._silence < self._within - 1.25 * _SHARE_PERIOD:
            self._worked = -1.0
            return False
        self._measure()
        if self._silence < self._within:
            return False
        return not (self._busy and self._silence < self._within + PATIENCE)

    def _read(self) -> None:
        for pid, within in self._beats.read() if self._beats is not None else ():
            if pid != self._beater:
                if self._beater and state(self._beater):
                    continue  # a child that inherited the address does not speak for the program
                self._beater = pid
            self._within, self._silence = within, 0.0

    def _measure(self) -> None:
        """Compare what the threads did with the time that has passed."""
        if self._worked < 0.0:
            self._busy = False
        elif self._silence < self._measured + _SHARE_PERIOD:
            return
        else:
            self._busy = wants_to_run(self._beater) or (
                work(self._beater) - self._worked > BUSY * (self._silence - self._measured)
            )
        self._worked, self._measured = work(self._beater), self._silence


def state(pid: int) -> str:
    """The letter of proc(5) for the state of a process; empty when there is none."""
    fields = _stat(pid)
    return fields[0] if fields else ""


def start_time(pid: int) -> int:
    """When a process started [clock ticks since the machine did]; process ids are used again, the two together are
    not. 0 when there is none, or it has ended."""
    fields = _stat(pid)
    return int(fields[19]) if fields and fields[0] not in "ZX" else 0


def foreground(pid: int) -> int:
    """The process group that has the terminal of a process, so the job that a shell runs, or the shell's own; 0 or less
    when there is none."""
    fields = _stat(pid)
    return int(fields[5]) if fields else 0


def work(pid: int) -> float:
    """Seconds that the threads of a process have run or waited for a processor, all together."""
    total = 0
    for schedule in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        with contextlib.suppress(OSError):  # a thread has just ended
            ran, waited, _ = schedule.read_text().split()
            total += int(ran) + int(waited)
    return total / 1e9


def wants_to_run(pid: int) -> bool:
    """Whether a thread of the process runs, waits for a processor, or is in uninterruptible sleep, for a disk mostly.
    `work` does not count how long one has been waiting until it gets the processor."""
    with contextlib.suppress(OSError):
        threads = os.listdir(f"/proc/{pid}/task")
        return any(_stat(pid, f"/task/{thread}")[:1] in (["R"], ["D"]) for thread in threads)
    return False


def failure(process: subprocess.Popen) -> str:
    """What has befallen a program that gives no beats: "died: signal 9", "froze"; empty while it is there."""
    code = process.poll()
    if code is not None:
        return cause(code)
    return "froze" if state(process.pid) == _STOPPED else ""


def cause(code: int) -> str:
    """What ended a program, from the exit code of `subprocess`: "died: signal 9", "died: exit code 1"."""
    if code == UNKNOWN:
        return "died"
    return f"died: signal {-code}" if code < 0 else f"died: exit code {code}"


def _stat(pid: int, thread: str = "") -> list[str]:
    """The fields of proc(5) from the third on: the state is the first, the start time the twentieth."""
    try:
        with open(f"/proc/{pid}{thread}/stat", "rb", buffering=0) as file:
            # The program's name stands in brackets and may hold blanks and brackets itself.
            return file.read(1024).rpartition(b")")[2].decode("ascii").split()
    except OSError:
        return []  # it has ended


def _within(words: list[str]) -> float:
    for word in words:
        name, _, value = word.partition("=")
        if name == "WATCHDOG_USEC" and value.isascii() and value.isdigit():
            return int(value) / 1e6
    return WITHIN
