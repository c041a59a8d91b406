"""DriveLink: the pilot's end of the wire to the drive server on the robot (`telepresence.drive.datagram`). No ROS.

It needs the robot's key, `./stack pair ROBOT`; only a robot on this machine's loopback, a simulated one, needs none.
What is not signed with the key is not believed.

A velocity that is another one than before is sent by whoever gives it. A thread of its own sends the newest 20 times a
second, with how long ago the pilot gave it, and receives what the robot made of it. A velocity that is not renewed is
dropped here; one that never arrives is missed there. A goal is repeated until it is reached or ended; it ends, too,
when the robot was not heard to drive to it for half a second.
"""

from __future__ import annotations

import contextlib
import getpass
import math
import select
import socket
import threading
import time

from telepresence.drive.datagram import (
    DEFAULT_PORT,
    MAX_DATAGRAM,
    PERIOD,
    BadMessage,
    Report,
    decode,
    encode,
    encode_velocity,
    parse_report,
    short,
)
from telepresence.drive.pilots_goal import PilotsGoal
from telepresence.drive.pilots_requests import Done, PilotsRequests
from telepresence.drive.session import COOKIE_LIFE, LONGEST_NAME, KeyMismatch, PilotHandshake, Session
from telepresence.geometry import require_finite
from telepresence.host_port import parse_host_port
from telepresence.security.robot_key import RobotKey, is_loopback
from telepresence.station.fault_sentences import DRIVE_SERVER

LINK_TIMEOUT = 0.3
"""Seconds for which a velocity is valid here: windows repeat it every 0.05 s, keyboard nodes every 0.1 s."""
SILENCE = 0.4
"""Seconds without a report after which the robot counts as not answering."""
HELLO_PERIOD = 0.25
"""Seconds between two greetings while the robot is silent or knows no session of ours."""
REOPEN_PERIOD = 2.0
"""Seconds of silence after which another socket is tried."""
REQUEST_TIMEOUT = 2.0
"""Seconds; until then a request without an answer is repeated with every command."""


class DriveLink:
    """Connected from construction until `close`; the thread comes back from every outage.

    Args:
        address: Host or host:port of the drive server.
        key: The robot's; by default that of the pilot's store, looked for again at every greeting.
        name, rank: Name and rank under which the robot knows this pilot; by default the user and this computer.
    Attributes:
        problem: Why the robot does not answer; empty while it does.
        outages: How often it fell silent.
    Raises:
        ValueError: The address is invalid, or the name or rank is unfit.
    """

    def __init__(self, address: str, key: RobotKey | None = None, name: str = "", rank: int = 0) -> None:
        self.host, self.port = parse_host_port(address, DEFAULT_PORT, "a drive server")
        self._key, self._name, self._rank = key, name or _default_name(), rank
        PilotHandshake(None, self._name, self._rank)
        self.problem = f"{DRIVE_SERVER} at {self.host}:{self.port} has not answered yet."
        self.outages = 0
        self._lock = threading.Lock()  # protects what the pilot gives
        self._sending = threading.Lock()  # a datagram is made and sent before the next one
        self._velocity: tuple[float, float, float] | None = None
        self._given_at = -math.inf
        self._careful = self._hard = False
        self._goal = PilotsGoal()
        self._requests = PilotsRequests(self._name)
        self._report: Report | None = None
        self._echo: float | None = None  # the stamp of the newest report in this session
        self._heard_at = -math.inf
        self._fresh = threading.Event()
        self._session: Session | None = None
        self._handshake: PilotHandshake | None = None
        self._handshake_end = math.inf
        self._hint = ""
        self._tried_key = key
        self._obstacle = ""
        """Why no session can be opened, whatever is sent."""
        self._socket: socket.socket | None = None
        self._opened_at = -math.inf
        self._waker, self._wake = socket.socketpair()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="drive-link", daemon=True)
        self._thread.start()

    def drive(self, vx: float, vy: float, wz: float, careful: bool = False) -> None:
        """Take the velocity that the pilot commands now [m/s, m/s, rad/s].

        Raises:
            ValueError: A value is not finite; the robot receives that the pilot commands nothing.
        """
        velocity = (vx, vy, wz)
        with self._lock:
            changed = self._velocity != velocity
            self._velocity = velocity if all(map(math.isfinite, velocity)) else None
            self._given_at = time.monotonic()
            self._careful = careful
        if changed and not self._stop.is_set():
            self._send_drive(time.monotonic())
        require_finite("velocity", velocity)

    def release(self, hard: bool = False) -> None:
        """Take that the pilot commands nothing any more.

        Args:
            hard: Because something failed: the robot is to stop as fast as for a pilot who fell silent.
        """
        with self._lock:
            changed = self._velocity is not None
            self._velocity, self._hard = None, hard
        if changed and not self._stop.is_set():
            self._send_drive(time.monotonic())

    def go_to(self, x: float, y: float, theta: float) -> int:
        """Have the robot drive to a pose relative to where it is now [m, m, rad]; the goal's number, as in reports.

        A velocity that is given by `drive` ends it, and so do `end_goal`, another goal, and an outage.

        Raises:
            ValueError: A value is not finite.
        """
        require_finite("goal", (x, y, theta))
        with self._lock:
            number = self._goal.give((x, y, theta), time.monotonic())
        with contextlib.suppress(OSError):
            self._waker.send(b"x")
        return number

    def end_goal(self) -> None:
        """Have the robot stop driving to the goal."""
        with self._lock:
            self._goal.end()
        with contextlib.suppress(OSError):
            self._waker.send(b"x")

    def goal_state(self) -> str:
        """What became of the newest goal, see `PilotsGoal.state`."""
        with self._lock:
            return self._goal.state(time.monotonic())

    def ask(self, what: str, timeout: float = REQUEST_TIMEOUT) -> Done:
        """Have the robot do one of `datagram.REQUESTS`; waits for the answer, asking again until it comes. A stop that
        was done is asked of a drive server that has started again, too, until it is reset."""
        done = self._requests.ask(what, timeout)
        return done or Done(False, self.problem or f"The robot did not answer within {timeout:g} s.")

    def report(self) -> tuple[Report | None, float]:
        """The newest report and its age [s]; None before the first."""
        with self._lock:
            return self._report, time.monotonic() - self._heard_at

    def wait_report(self, timeout: float) -> bool:
        """Wait for a report that was not waited for yet; False if none came."""
        came = self._fresh.wait(timeout)
        self._fresh.clear()
        return came

    def close(self) -> None:
        """Send once that the pilot leaves, and end."""
        self._stop.set()
        with contextlib.suppress(OSError):
            self._waker.send(b"x")
        self._thread.join(timeout=2.0)
        self._waker.close()
        self._wake.close()

    # --- the thread --------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        due = hello_due = 0.0
        while not self._stop.is_set():
            now = time.monotonic()
            self._judge(now)
            if now >= due:
                due = now + PERIOD
                if self._session is not None:
                    self._send_drive(now)
                    self._send_requests()
                if (self._session is None or now - self._heard_at > SILENCE) and now >= hello_due:
                    hello_due = now + HELLO_PERIOD
                    self._open(now)
                    self._greet(now)
            sockets = [each for each in (self._socket, self._wake) if each is not None]
            ready, _, _ = select.select(sockets, [], [], max(0.0, due - time.monotonic()))
            if self._wake in ready:
                self._wake.recv(64)
                due = 0.0  # something new must not wait for its turn
            if self._socket in ready:
                self._receive()
        with self._lock:
            self._velocity = None
            self._goal.end()
        self._send_drive(time.monotonic())
        with self._sending:
            self._send_body(encode(type="ask", id=0, what="leave"))
        if self._socket is not None:
            self._socket.close()

    def _judge(self, now: float) -> None:
        silent = now - self._heard_at
        if silent <= SILENCE:
            self.problem = ""
            return
        if not self.problem:
            self.outages += 1
        if self._obstacle:
            self.problem = f"{DRIVE_SERVER} at {self.host}:{self.port} {self._obstacle}"
            return
        lasting = f" for {silent:.1f} s" if math.isfinite(silent) else ""
        hint = self._hint or "is it running, and is the network there?"
        self.problem = f"{DRIVE_SERVER} at {self.host}:{self.port} does not answer{lasting}: {hint}"

    def _open(self, now: float) -> None:
        """A socket of the route as it is now, once in a while: networks come back with other addresses."""
        if self._socket is not None:
            if now - max(self._opened_at, self._heard_at) <= REOPEN_PERIOD:
                return
            self._socket.close()
            self._socket = None
        self._session, self._handshake, self._opened_at = None, None, now
        try:
            family, kind, _, _, target = socket.getaddrinfo(self.host, self.port, type=socket.SOCK_DGRAM)[0]
            opened = socket.socket(family, kind)
        except OSError as error:
            self._hint = (error.strerror or str(error)).lower()
            return
        try:
            opened.setblocking(False)
            opened.connect(target)
        except OSError as error:
            opened.close()
            self._hint = (error.strerror or str(error)).lower()
            return
        self._socket = opened

    def _greet(self, now: float) -> None:
        """Say hello, or go on with the handshake that has begun."""
        if self._socket is None:
            return
        try:
            if self._handshake is None or now > self._handshake_end:
                key = self._key or RobotKey.of(self.host)
                if key != self._tried_key:
                    self._tried_key, self._obstacle = key, ""
                if key is None and not is_loopback(self._socket.getpeername()[0]):
                    self._obstacle = f"needs the robot's key, and this computer has none for it: {self._remedy()}"
                    return
                self._handshake, self._handshake_end = PilotHandshake(key, self._name, self._rank), math.inf
        except (OSError, ValueError) as error:
            self._obstacle = f"cannot be asked: {error}"
            return
        self._send(self._handshake.open or self._handshake.hello)

    def _remedy(self, forget: bool = False) -> str:
        return f"type  ./stack pair {'--forget ' if forget else ''}{self.host}"

    def _send_drive(self, now: float) -> None:
        with self._sending:
            self._send_newest(now)

    def _send_newest(self, now: float) -> None:
        with self._lock:
            fresh = now - self._given_at <= LINK_TIMEOUT
            velocity = self._velocity if fresh else None
            echo, heard_at = self._echo, self._heard_at
            if velocity is not None:
                self._goal.end()
            goal, given_at = self._goal.wanted(now) or (None, self._given_at)
            failed = self._velocity is not None and not fresh  # whoever gave it has frozen
            after, careful, hard = given_at - heard_at, self._careful, self._hard or failed
        if echo is None:
            return
        after = after if math.isfinite(after) else 0.0
        if velocity is not None:
            self._send_body(encode_velocity(echo, after, velocity, careful))
            return
        self._send_body(
            encode(
                type="drive",
                echo=echo,
                after=after,
                velocity=None,
                careful=careful,
                goal=goal and {"id": goal.number, "pose": goal.pose},
                hard=hard and goal is None,
            )
        )

    def _send_requests(self) -> None:
        for number, what in self._requests.waiting():
            with self._sending:
                self._send_body(encode(type="ask", id=number, what=what))

    def _send_body(self, body: bytes) -> None:
        session = self._session
        if session is not None:
            self._send(session.seal(body))

    def _send(self, datagram: bytes) -> None:
        link = self._socket
        if link is None:
            return
        try:
            link.send(datagram)
        except BlockingIOError:
            pass  # the network takes nothing now; this one is lost as any may be
        except OSError as error:
            self._hint = _cause(error)

    def _receive(self) -> None:
        while self._socket is not None:
            try:
                datagram = self._socket.recv(MAX_DATAGRAM + 1)
            except BlockingIOError:
                return
            except OSError as error:
                self._hint = _cause(error)
                return
            try:
                self._take(datagram, time.monotonic())
            except BadMessage as error:
                self._hint = f"what answers there is no drive server ({error})"

    def _take(self, datagram: bytes, now: float) -> None:
        """Take a datagram from the robot's address, which may be anybody's.

        Raises:
            BadMessage: It is the robot's, but cannot be understood.
        """
        handshake = self._handshake
        for session in (self._session, handshake.session if handshake else None):
            body = session.unseal(datagram) if session is not None else None
            if body is None:
                continue
            if session is not self._session:
                self._session, self._handshake, self._obstacle = session, None, ""
                with self._lock:
                    self._echo = None
                    self._goal.end_begun()
            self._handle(decode(body))
            return
        try:
            if handshake is not None and handshake.take(datagram):
                self._handshake_end, self._obstacle = now + COOKIE_LIFE, ""
                self._send(handshake.open)
        except KeyMismatch as error:
            self._handshake, self._obstacle = None, f"{error}: {self._remedy(error.robot_has_none)}"

    def _handle(self, fields: dict) -> None:
        match fields["type"]:
            case "refused":
                self._hint = short(str(fields.get("text")))
            case "done" if isinstance(number := fields.get("id"), int):
                self._requests.answer(number, Done(fields.get("ok") is True, short(str(fields.get("text", "")))))
            case "report":
                report = parse_report(fields)
                self._requests.report(report)
                with self._lock:
                    self._report, self._heard_at, self._hint = report, time.monotonic(), ""
                    self._echo = report.stamp
                    if report.goal:
                        self._goal.reported(report.goal, self._heard_at)
                self._fresh.set()


def _cause(error: OSError) -> str:
    if isinstance(error, ConnectionRefusedError):
        return "no program listens there; is the drive server started?"
    return (error.strerror or str(error)).lower()


def _default_name() -> str:
    """User and computer, as what the robot knows this pilot."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a number without a name
        user = "somebody"
    name = "".join(letter for letter in f"{user}@{socket.gethostname()}" if letter.isprintable())
    return name[:LONGEST_NAME]
