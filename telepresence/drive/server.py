# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP024, UP031
"""The robot's end of the drive wire: socket, pilots, reports and the loop, for any robot. Standard library only.

What is driven, a `DrivenBase`, is asked at least every `PERIOD` what it makes of the pilots' command, and at once when
the command changes or ends. It must answer at once: a robot that does not, delays the reports of all.
"""

import errno
import os
import select
import socket
import time
from collections import namedtuple

from telepresence.drive.clock import monotonic
from telepresence.drive.datagram import INFINITY, MAX_DATAGRAM, Report, encode_report
from telepresence.drive.pace import Pace
from telepresence.drive.pilots import Pilots, Request

MYPY = False
if MYPY:
    from typing import Callable, Optional, Tuple  # noqa: F401, UP035

    from telepresence.drive.datagram import Goal, Vector  # noqa: F401
    from telepresence.drive.pilots import Outgoing, PilotVelocity  # noqa: F401
    from telepresence.security.shared_key import SharedKey  # noqa: F401

PERIOD = 0.05
"""Seconds between two decisions, and between two reports."""
SHORTEST_PERIOD, BURST = 0.02, 3
"""A new command is decided on at once, but on average not more often than this [s]: that many may follow each other."""
BREATH = 0.001
"""Seconds of rest after a hundred datagrams that no pilot has sent."""
LOG_PERIOD = 1.0
"""Seconds between two lines about datagrams: whoever sends many does not fill the disk."""
NO_COMMAND, FAULT, STOPPED, CLEAR = "no command", "fault", "stopped", "clear"
IDLE = (NO_COMMAND, "blocked", "limited", CLEAR)
"""States (`telepresence.safety.State`) that say nothing about the robot itself."""
AT_REST = (0.0, 0.0, 0.0)
_NOTHING_NOW = (errno.EAGAIN, errno.EWOULDBLOCK)


class Outcome(namedtuple("Outcome", "state reason given allowed gap sector command_age scanning")):
    """What the robot does now and why; the fields are those of `telepresence.drive.datagram.Report`."""

    __slots__ = ()


class DrivenBase(object):
    """What a drive server drives. One thread calls it."""

    def step(self, now, command, goal, pilots):
        # type: (float, Optional[PilotVelocity], Optional[Goal], Pilots) -> Outcome
        """Obey the command or drive to the goal, or neither; `pilots` knows whether they let go or were cut off."""
        raise NotImplementedError

    def due(self):
        # type: () -> float
        """When `step` is needed at the latest [s]; infinity for no earlier than usual."""
        return INFINITY

    def do(self, what, who):
        # type: (str, str) -> Tuple[bool, str]
        """Do one of `telepresence.drive.datagram.REQUESTS`; whether it was done, and a sentence."""
        raise NotImplementedError

    def end(self):
        # type: () -> None
        """The server ends: stop."""


class DriveServer(object):
    """Bound when constructed; `run` serves until `stop`.

    Args:
        base: What is driven.
        address, port: Where to listen; port 0 takes a free one.
        key: The robot's, which pilots must have. Without one whoever reaches the port may drive.
        log: Takes a line for people.
    Raises:
        OSError: The port is taken or the address is not this machine's; the text names both.
    """

    def __init__(self, base, address, port, key, log):
        # type: (DrivenBase, str, int, Optional[SharedKey], Callable[[str], None]) -> None
        self._base, self._log = base, log
        self._pilots = Pilots(key)
        self._log_due, self._unsaid, self._refused = -INFINITY, 0, 0
        self._reports, self._started = 0, monotonic()
        self._reported = -INFINITY
        self._stopping = False
        self._waker, self._wake = socket.socketpair()
        self._waker.setblocking(False)
        self._socket = _bind(address, port)
        self._watchdog = ServiceWatchdog(os.environ.get("NOTIFY_SOCKET", ""))
        self.address, self.port = self._socket.getsockname()[:2]

    def run(self):
        # type: () -> int
        """Serve until `stop`; the exit status."""
        due, known, pace = monotonic(), None, Pace(SHORTEST_PERIOD, BURST)  # type: Tuple[float, object, Pace]
        while not self._stopping:
            now = monotonic()
            command, goal = self._pilots.command(now), self._pilots.goal(now)
            new = command[:3] if command is not None else goal
            urgent = new != known
            if now >= min(due, self._base.due()) or (urgent and now >= pace.due()):
                if urgent:
                    pace.take(now)
                self._tick(now, command, goal, urgent)
                known, urgent = new, False
                due = max(due + PERIOD, now) if now >= due else now + PERIOD
            soon = pace.due() if urgent else INFINITY
            self._listen(min(due, self._base.due(), self._pilots.deadline(), soon))
        self._base.end()
        return 0

    def stop(self):
        # type: () -> None
        """End `run`; from a signal handler too."""
        self._stopping = True
        try:
            self._waker.send(b"x")
        except socket.error:  # it is being woken already
            pass

    def close(self):
        # type: () -> None
        self._watchdog.close()
        for end in (self._socket, self._waker, self._wake):
            end.close()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _listen(self, until):
        # type: (float) -> None
        """Take the datagrams that come until `until` [s], at least those that wait already."""
        try:
            select.select([self._socket, self._wake], [], [], max(0.0, until - monotonic()))
        except select.error as error:  # Python 2.7, at a signal
            if error.args[0] != errno.EINTR:
                raise
        deadline = self._pilots.deadline()
        for _ in range(100):  # of a flood the rest must wait until the robot was served
            if self._pilots.deadline() != deadline:
                return  # a command came or was ended, which does not wait for other datagrams
            try:
                datagram, address = self._socket.recvfrom(MAX_DATAGRAM + 1)
            except socket.error as error:
                if error.errno in _NOTHING_NOW:
                    return
                continue  # Linux reports here that an earlier datagram reached no program
            for consequence in self._pilots.receive(datagram, address, monotonic()):
                self._send(self._do(consequence) if isinstance(consequence, Request) else consequence)
        # Linux takes the real-time priority from whoever never waits, and a flood would never let us.
        time.sleep(BREATH)

    def _do(self, request):
        # type: (Request) -> Outgoing
        ok, text = self._base.do(request.what, "%s" % request.pilot)
        if request.what == "leave":
            self._pilots.release(request.pilot)
        self._say("%s, asked by %s: %s" % (request.what, request.pilot, text or ("done" if ok else "refused")))
        return self._pilots.answered(request, ok, text)

    def _say(self, text):
        # type: (str) -> None
        """Log what a datagram caused, a line a second at most."""
        now = monotonic()
        if now < self._log_due:
            self._unsaid += 1
            return
        more = " (and %d lines like this were left out)" % self._unsaid if self._unsaid else ""
        self._log_due, self._unsaid = now + LOG_PERIOD, 0
        self._log(text + more)

    def _send(self, outgoing):
        # type: (Outgoing) -> None
        try:
            self._socket.sendto(outgoing.datagram, outgoing.address)
        except socket.error:
            pass  # lost, as any datagram may be: the network is away, or takes nothing now

    def _tick(self, now, command, goal, new):
        # type: (float, Optional[PilotVelocity], Optional[Goal], bool) -> None
        outcome = self._base.step(now, command, goal, self._pilots)
        # A base that tries again every millisecond tells nothing new each time, and pilots know the newest few only.
        if new or now - self._reported >= SHORTEST_PERIOD:
            self._reported = now
            self._report(now, outcome, command is not None or goal is not None)
        if self._pilots.refused > self._refused and now >= self._log_due:
            count = self._pilots.refused - self._refused
            self._say("%d datagrams refused, the last one: %s" % (count, self._pilots.refusal))
            self._refused = self._pilots.refused
        self._watchdog.beat(now)

    def _report(self, now, outcome, commanded):
        # type: (float, Outcome, bool) -> None
        self._reports += 1
        driver = self._pilots.driver
        for pilot in self._pilots.everyone:
            state, reason = outcome.state, outcome.reason
            if driver not in (None, pilot) and state in IDLE:
                state, reason = NO_COMMAND, "Another pilot drives: %s." % driver
            elif not commanded and state in IDLE:
                state, reason = NO_COMMAND, self._pilots.problem or "Nobody drives."
            about = self._pilots.goal_state(pilot), self._started
            report = Report(*((now, self._reports, state, reason) + outcome[2:] + about))  # noqa: RUF005
            self._pilots.reported(pilot, now)
            self._send(pilot.send(encode_report(report)))


class ServiceWatchdog(object):
    """Signs of life for whoever started this program, by systemd's protocol (sd_notify(3)).

    Args:
        path: Of the datagram socket that takes them, `NOTIFY_SOCKET`; empty when nobody wants them.
    """

    SHORTEST_PERIOD = 0.1

    def __init__(self, path):
        # type: (str) -> None
        self._path = "\0" + path[1:] if path.startswith("@") else path
        self._due = -INFINITY
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) if path else None
        if self._socket is not None:
            self._socket.setblocking(False)

    def beat(self, now):
        # type: (float) -> None
        """The loop that does the work went round at `now` [s]."""
        if self._socket is None or now < self._due:
            return
        self._due = now + self.SHORTEST_PERIOD
        try:
            self._socket.sendto(b"WATCHDOG=1", self._path)
        except socket.error:
            pass  # who does not take it, misses it

    def close(self):
        # type: () -> None
        if self._socket is not None:
            self._socket.close()


def _bind(address, port):
    # type: (str, int) -> socket.socket
    bound = socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET, socket.SOCK_DGRAM)
    try:
        bound.setblocking(False)
        bound.bind((address, port))
    except socket.error as error:
        bound.close()
        reason = "cannot listen on %s, udp port %d: %s" % (address, port, error.strerror)
        failed = OSError(error.errno, reason)
    else:
        return bound
    raise failed
