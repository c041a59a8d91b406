"""Single keys from a terminal, without echo, and the terminal put back as it was.

The terminal stays in its usual output mode (a newline returns the carriage) and Ctrl-C stays a signal, so that this
works below roslaunch, whose nodes share its terminal. roslaunch puts them into sessions of their own: the kernel then
neither stops nor hangs up this process with the job it belongs to, so `in_foreground` has to check.
"""

from __future__ import annotations

import codecs
import contextlib
import os
import select
import termios
import time
from pathlib import Path
from types import TracebackType

from twist_keyboard.keys import split_keys

PARTING_TIME = 0.3
"""Seconds allowed for the last zero to be sent: rospy sends from a thread of its own, late on a busy machine."""
_OWN_TERMINAL = os.makedev(5, 0)  # /dev/tty, whichever terminal that is


def clock() -> float:
    """Return the time of a clock that goes on while the machine sleeps [s]."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def say(text: str) -> None:
    """Print for the pilot. A terminal that has gone away is no reason to die before the robot has its zero."""
    try:
        print(text, flush=True)
    except OSError:
        return


class HungUp(OSError):
    """The terminal is gone."""


class KeyTerminal:
    """A terminal that hands over keys as they are pressed; a context manager.

    Args:
        descriptor: An open file for which `os.isatty` is true.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self._poll = select.poll()
        self._poll.register(descriptor, 0)  # reports nothing but a hang-up
        self._has_job = self._job_in_foreground() is not None

    def __enter__(self) -> KeyTerminal:
        if self.in_foreground():
            self._switch(single_keys=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        # A shell that has the terminal now has its own settings in it. Otherwise line input and echo are what a program
        # finds; the settings at our start may be the ones that a predecessor left when it was killed.
        try:
            if self.in_foreground():
                self._switch(single_keys=False)
        except HungUp:
            return  # nothing left to restore

    def read_keys(self, timeout: float) -> list[str]:
        """The keys pressed meanwhile, after at most `timeout` seconds; see `keys.split_keys`.

        Raises:
            HungUp: The terminal has been closed.
        """
        if not select.select([self._descriptor], [], [], timeout)[0]:
            return []
        try:
            data = os.read(self._descriptor, 1024)
        except OSError as error:
            raise HungUp(f"the terminal is gone: {error.strerror}") from error
        if not data:
            raise HungUp("the terminal is gone")
        return split_keys(self._decoder.decode(data))

    def in_foreground(self) -> bool:
        """Whether keys typed here are meant for us: not for the shell that has put our job aside (Ctrl-Z, &), and not
        for whoever has the terminal after the job that we belonged to was killed.

        Raises:
            HungUp: The terminal has been closed.
        """
        if self._poll.poll(0):
            raise HungUp("the terminal is gone")
        found = self._job_in_foreground()
        return not self._has_job if found is None else found

    def _job_in_foreground(self) -> bool | None:
        return _job_in_foreground(os.getpid(), os.fstat(self._descriptor).st_rdev)

    def resume(self) -> None:
        """Ask for single keys again, after a shell used the terminal; keys typed for the shell are dropped.

        Raises:
            HungUp: The terminal has been closed.
        """
        self._switch(single_keys=True)
        with contextlib.suppress(termios.error):  # a hang-up this very moment shows at the next read
            termios.tcflush(self._descriptor, termios.TCIFLUSH)

    def _switch(self, single_keys: bool) -> None:
        try:
            settings = termios.tcgetattr(self._descriptor)
            if single_keys:
                settings[3] &= ~(termios.ICANON | termios.ECHO)
                settings[6][termios.VMIN], settings[6][termios.VTIME] = 1, 0
            else:
                settings[3] |= termios.ICANON | termios.ECHO
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, settings)
        except termios.error as error:
            raise HungUp(f"the terminal is gone: {error.args[-1]}") from error


def _job_in_foreground(pid: int, device: int) -> bool | None:
    """Follow the parents of `pid` to the first whose controlling terminal is `device`, and see whether that one's
    process group is the terminal's foreground group and not stopped. None when there is no such parent.

    Source: proc(5), /proc/pid/stat: state, ppid, pgrp, session, tty_nr, tpgid.
    """
    while pid > 1:
        try:
            stat = Path(f"/proc/{pid}/stat").read_text()
        except OSError:
            return None
        state, parent, group, _, terminal, foreground = stat.rpartition(")")[2].split()[:6]
        if int(terminal) == device or (device == _OWN_TERMINAL and int(terminal) != 0):
            return group == foreground and state != "T"
        pid = int(parent)
    return None
