# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP024, UP031
"""Who stops the robot when the drive server dies, freezes or loses NAOqi: a second process with its own link to it.

The server writes a byte at every step, MOVING or RESTING, to a socket, and the second process answers each. While the
robot moves, `SILENCE` without a byte, or the connection's end, makes the second process call stopMove, and killMove a
moment later; so does STOP, at once. It ends with the connection. One that dies, or does not answer, is started again
by the server.
"""

import errno
import os
import select
import signal
import socket
import subprocess
import sys

from naoqi_driver.onboard.naoqi_link import NaoqiLink, first_line
from telepresence.drive.clock import monotonic
from telepresence.drive.datagram import INFINITY

MYPY = False
if MYPY:
    from typing import Any, Callable, List, Optional  # noqa: F401, UP035

MOVING, RESTING, STOP, ANSWER = b"m", b"r", b"s", b"a"
SILENCE = 0.2
"""Seconds without a byte of a server whose robot moves: four steps were missed."""
KILL_TIME = 0.1
"""Seconds from stopMove to killMove."""
ANSWER_TIME = 0.6
"""Seconds without an answer after which the second process counts as frozen."""
START_TIME = 5.0
"""Seconds that it gets besides to start on a busy machine."""
RESTART_PERIOD = 1.0
"""Seconds between two starts of the second process."""
END_TIME = 2.0
"""Seconds within which it ends with the connection; it may have to stop the robot first."""
_NOT_TAKEN = (errno.EAGAIN, errno.EWOULDBLOCK, errno.EPIPE, errno.ECONNRESET)


class LastStop(object):
    """The server's end of the connection.

    Args:
        command: The words that start the second process.
    """

    def __init__(self, command):
        # type: (List[str]) -> None
        self._command = command
        self._process = None  # type: Any
        self._ours = None  # type: Any
        self._started, self._heard = -INFINITY, -INFINITY

    def note(self, moving, now):
        # type: (bool, float) -> str
        """The server is alive at `now` [s]; return what has just befallen the second process, or an empty text."""
        befallen = self._look(now)
        if befallen:
            self._end()
        if self._process is None and now - self._started >= RESTART_PERIOD:
            self._start(now)
        self._say(MOVING if moving else RESTING)
        return befallen

    def stop(self):
        # type: () -> None
        """Have the second process stop the robot: the server cannot, and the robot moves."""
        self._say(STOP)

    def close(self):
        # type: () -> None
        """End the second process: it stops the robot if that still moves."""
        if self._process is None:
            return
        self._ours.close()
        deadline = monotonic() + END_TIME
        while self._process.poll() is None and monotonic() < deadline:
            select.select([], [], [], 0.01)
        self._end()

    def _say(self, what):
        # type: (bytes) -> None
        if self._process is None:
            return
        try:
            self._ours.send(what)
        except socket.error as error:
            if error.errno not in _NOT_TAKEN:
                raise

    def _look(self, now):
        # type: (float) -> str
        if self._process is None:
            return ""
        if self._process.poll() is not None:
            return "died"
        try:
            if self._ours.recv(4096):
                self._heard = now
        except socket.error:  # nothing there now; of its end `poll` tells
            pass
        return "froze" if now - self._heard > ANSWER_TIME else ""

    def _start(self, now):
        # type: (float) -> None
        self._ours, theirs = socket.socketpair()
        self._ours.setblocking(False)
        # Of a session of its own, so that what ends the server and its group does not end it.
        self._process = subprocess.Popen(self._command, stdin=theirs.fileno(), close_fds=True, preexec_fn=os.setsid)
        theirs.close()
        self._started, self._heard = now, now + START_TIME

    def _end(self):
        # type: () -> None
        self._ours.close()
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._process = None


def watch(url, log):
    # type: (str, Callable[[str], None]) -> int
    """Be the second process, at the connection that is standard input; the exit status."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    server = socket.fromfd(0, socket.AF_UNIX, socket.SOCK_STREAM)
    server.setblocking(False)  # a server that is frozen takes no answers, and must be watched all the same
    link = NaoqiLink(url, lambda _text: None)  # the server says the same
    moving, heard, kill_at = False, monotonic(), INFINITY
    while True:
        due = min(heard + SILENCE if moving else INFINITY, kill_at)
        timeout = None if due == INFINITY else max(0.0, due - monotonic())
        ready = select.select([server], [], [], timeout)[0]
        said = _heard(server) if ready else b""
        now = monotonic()
        if said:
            moving, heard = said[-1:] == MOVING, now
        ended = bool(ready) and not said
        lost = STOP in said and kill_at == INFINITY
        if lost or (moving and (ended or now - heard >= SILENCE)):
            befell = "lost NAOqi" if lost else "died" if ended else "froze"
            log("the drive server %s: stopping the robot" % befell)
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


def _heard(server):
    # type: (socket.socket) -> bytes
    """Return what the server has written, and answer it; nothing at the connection's end."""
    try:
        said = server.recv(4096)
    except socket.error:  # it died, and had not read all answers
        return b""
    try:
        server.send(ANSWER)
    except socket.error:  # it is frozen and takes no more; or it has died, which the next call finds
        pass
    return said


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
