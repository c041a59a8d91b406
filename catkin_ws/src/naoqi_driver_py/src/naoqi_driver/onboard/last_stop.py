# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP024, UP031
"""Who stops the robot when the drive server dies, freezes or loses NAOqi: a second process with its own link to it.

The server writes a byte at every step, MOVING or RESTING, to a socket, and the second process answers each, READY or
BLIND: without a link to NAOqi. While the robot moves, `SILENCE` without a byte, or the connection's end, makes the
second process call stopMove, and killMove a moment later; so does STOP, at once. What it cannot call it tries again. It
ends with the connection. One that dies, or does not answer, is started again by the server.
"""

import errno
import os
import select
import signal
import socket
import subprocess
import sys

from naoqi_driver.onboard.naoqi_link import NaoqiLink
from telepresence.drive.clock import monotonic
from telepresence.drive.datagram import INFINITY
from telepresence.robot_side.naoqi_values import error_text

MYPY = False
if MYPY:
    from typing import Any, Callable, List, Optional  # noqa: F401, UP035

MOVING, RESTING, STOP = b"m", b"r", b"s"
READY, BLIND = b"a", b"b"
SILENCE = 0.2
"""Seconds without a byte of a server whose robot moves: four steps were missed."""
KILL_TIME = 0.1
"""Seconds from stopMove to killMove, and between two tries of what cannot be called."""
LAST_TRY_TIME = 2.0
"""Seconds for which a second process without a server tries to stop the robot."""
ANSWER_TIME = 0.6
"""Seconds without an answer after which the second process counts as frozen."""
START_TIME = 5.0
"""Seconds that it gets besides to start on a busy machine, and to be connected with NAOqi."""
RESTART_PERIOD = 1.0
"""Seconds between two starts of the second process."""
END_TIME = 2.5
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
        self._started, self._heard, self._ready = -INFINITY, -INFINITY, -INFINITY

    def note(self, moving, now):
        # type: (bool, float) -> str
        """The server is alive at `now` [s]; return what has just befallen the second process, or an empty text."""
        befallen = self._look(now)
        if befallen:
            self._end()
        if self._process is None and now - self._started >= RESTART_PERIOD:
            befallen = self._start(now) or befallen
        self._say(MOVING if moving else RESTING)
        return befallen

    def is_blind(self, now, since):
        # type: (float, float) -> bool
        """Whether the second process runs, but has had no link to NAOqi for `START_TIME`, although there could be one
        since then [s]."""
        return self._process is not None and now - max(self._ready, since) > START_TIME

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
            return "died, and starts again"
        try:
            answers = self._ours.recv(4096)
            if answers:
                self._heard = now
            if READY in answers:
                self._ready = now
        except socket.error:  # nothing there now; of its end `poll` tells
            pass
        return "froze, and starts again" if now - self._heard > ANSWER_TIME else ""

    def _start(self, now):
        # type: (float) -> str
        """Start the second process; return why that cannot be now, or an empty text."""
        self._started = self._ready = now
        try:
            ours, theirs = socket.socketpair()
        except socket.error as error:
            return "cannot be started (%s)" % error.strerror
        try:
            # Of a session of its own, so that what ends the server and its group does not end it.
            process = subprocess.Popen(self._command, stdin=theirs.fileno(), close_fds=True, preexec_fn=os.setsid)
        except EnvironmentError as error:
            ours.close()
            return "cannot be started (%s)" % error.strerror
        finally:
            theirs.close()
        ours.setblocking(False)
        self._process, self._ours, self._heard = process, ours, now + START_TIME
        return ""

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
    moving, heard = False, monotonic()
    stopping = None  # type: Optional[Stopping]
    while True:
        due = min(heard + SILENCE if moving else INFINITY, stopping.due if stopping is not None else INFINITY)
        timeout = None if due == INFINITY else max(0.0, due - monotonic())
        ready = select.select([server], [], [], timeout)[0]
        said = _heard(server, link.motion() is not None) if ready else b""
        now = monotonic()
        if said:
            moving, heard = said[-1:] == MOVING, now
            if stopping is not None and not stopping.asked and not stopping.begun:
                stopping = None  # a server that is back brakes itself; later this would stop who drives again
        ended = bool(ready) and not said
        lost = STOP in said and stopping is None
        befell = "lost NAOqi" if lost else "died" if ended else "froze"
        if lost or (moving and (ended or now - heard >= SILENCE)):
            moving, stopping = False, Stopping(link, log, now, lost)
            stopping.step(now)
            log("the drive server %s: stopping the robot" % befell)  # no line comes before a stop
        elif stopping is not None:
            stopping.step(now)
        if ended:
            break
        if stopping is not None and stopping.done:
            stopping = None
    given_up = monotonic() + LAST_TRY_TIME
    while stopping is not None and not stopping.done and monotonic() < given_up:
        select.select([], [], [], max(0.0, stopping.due - monotonic()))
        stopping.step(monotonic())
    return 0


class Stopping(object):
    """stopMove and killMove, each tried until it has been sent.

    Args:
        now: When the first one is due [s].
        asked: The server has asked for them.
    Attributes:
        due: When `step` is needed next [s].
        begun, done: The first one was sent; both were.
    """

    def __init__(self, link, log, now, asked):
        # type: (NaoqiLink, Callable[[str], None], float, bool) -> None
        self._link, self._log, self.asked = link, log, asked
        self._owed, self._said = ["stopMove", "killMove"], ""
        self.due, self.begun, self.done = now, False, False

    def step(self, now):
        # type: (float) -> None
        if now < self.due or self.done:
            return
        self.due = now + KILL_TIME
        try:
            self._call(self._owed[0])
        except RuntimeError as error:
            problem = "%s: %s; trying again" % (self._owed[0], error_text(error))
            if problem != self._said:
                self._said = problem
                self._log(problem)
            return
        del self._owed[0]
        self.begun, self.done = True, not self._owed

    def _call(self, name):
        # type: (str) -> None
        motion = self._link.motion()
        if motion is None:
            raise RuntimeError("no link to NAOqi: %s" % self._link.problem)
        answer = motion.send(name)
        if name == "killMove":
            answer.wait(0.5)  # perhaps the last word of this process; it must have left


def _heard(server, sees):
    # type: (socket.socket, bool) -> bytes
    """Return what the server has written, and answer it; nothing at the connection's end."""
    try:
        said = server.recv(4096)
    except socket.error:  # it died, and had not read all answers
        return b""
    try:
        server.send(READY if sees else BLIND)
    except socket.error:  # it is frozen and takes no more; or it has died, which the next call finds
        pass
    return said


def command(url):
    # type: (str) -> List[str]
    """Return the words that start this program as the second process."""
    return [sys.executable, os.path.abspath(sys.argv[0]), "--qi-url", url, "--last-stop"]
