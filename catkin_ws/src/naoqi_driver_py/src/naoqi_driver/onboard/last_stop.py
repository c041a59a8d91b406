# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP031
"""Who stops the robot when the drive server itself dies or freezes: a second process with its own link to NAOqi.

The server writes a byte at every step into a pipe, MOVING or RESTING. While the robot moves, `SILENCE` without a byte,
or the pipe's end, makes the second process call stopMove, and killMove a moment later. It ends with the pipe.
"""

import errno
import fcntl
import os
import select
import signal
import subprocess
import sys

from naoqi_driver.onboard.naoqi_link import NaoqiLink, first_line
from telepresence.drive.clock import monotonic
from telepresence.drive.datagram import INFINITY

MYPY = False
if MYPY:
    from typing import Any, Callable, List, Optional  # noqa: F401, UP035

MOVING, RESTING = b"m", b"r"
SILENCE = 0.2
"""Seconds without a byte of a server whose robot moves: four steps were missed."""
KILL_TIME = 0.1
"""Seconds from stopMove to killMove."""
RESTART_PERIOD = 1.0
"""Seconds between two starts of the second process."""


class LastStop(object):
    """The server's end of the pipe.

    Args:
        command: The words that start the second process.
    """

    def __init__(self, command):
        # type: (List[str]) -> None
        self._command = command
        self._process = None  # type: Any
        self._started = -INFINITY

    def note(self, moving, now):
        # type: (bool, float) -> None
        """The server is alive at `now` [s]."""
        if self._process is None or self._process.poll() is not None:
            if now - self._started < RESTART_PERIOD:
                return
            self._started = now
            # Of a session of its own, so that what ends the server and its group does not end it.
            self._process = subprocess.Popen(self._command, stdin=subprocess.PIPE, close_fds=True, preexec_fn=os.setsid)
            pipe = self._process.stdin.fileno()
            fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_NONBLOCK)
        try:
            os.write(self._process.stdin.fileno(), MOVING if moving else RESTING)
        except OSError as error:
            if error.errno not in (errno.EAGAIN, errno.EPIPE):
                raise

    def close(self):
        # type: () -> None
        if self._process is not None:
            self._process.stdin.close()
            self._process.wait()


def watch(url, log):
    # type: (str, Callable[[str], None]) -> int
    """Be the second process, until standard input ends; the exit status."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    link = NaoqiLink(url, lambda _text: None)  # the server says the same
    moving, heard, kill_at = False, monotonic(), INFINITY
    while True:
        due = min(heard + SILENCE if moving else INFINITY, kill_at)
        timeout = None if due == INFINITY else max(0.0, due - monotonic())
        ready = select.select([0], [], [], timeout)[0] if timeout is not None else select.select([0], [], [])[0]
        said = os.read(0, 4096) if ready else b""
        now = monotonic()
        if said:
            moving, heard = said[-1:] == MOVING, now
        ended = bool(ready) and not said
        if moving and (ended or now - heard >= SILENCE):
            log("the drive server %s: stopping the robot" % ("died" if ended else "froze"))
            moving, kill_at = False, now + KILL_TIME
            _call(link, "stopMove", log)
        if ended and kill_at < INFINITY:
            select.select([], [], [], max(0.0, kill_at - monotonic()))
            now = monotonic()
        if now >= kill_at:
            kill_at = INFINITY
            _call(link, "killMove", log)
        if ended:
            return 0


def _call(link, name, log):
    # type: (NaoqiLink, str, Callable[[str], None]) -> None
    motion = link.motion()
    if motion is None:
        log("%s cannot be called: %s" % (name, link.problem))
        return
    try:
        answer = motion.send(name)
        if name == "killMove":
            answer.wait(0.5)  # the last word of this process; it must have left
    except RuntimeError as error:
        log("%s: %s" % (name, first_line(error)))


def command(url):
    # type: (str) -> List[str]
    """Return the words that start this program as the second process."""
    return [sys.executable, os.path.abspath(sys.argv[0]), "--qi-url", url, "--last-stop"]
