"""The drive server: the only program that commands this robot's wheels, with no network between it and them.

Datagrams from pilots (`telepresence.drive.datagram`) in, sensors from the robot's web server in, the gate of
`telepresence.safety` between, velocities to the web server out. A pilot who falls silent stops the robot: a zero 0.2 s
after the last command, then nothing, so that the robot's own watchdog (200 ms) holds the motors a moment later at the
latest; together at most half a second to standstill from 0.2 m/s. Who lets go of the controls gets the base's own
gentle ramp (0.4 m/s²) instead.
"""

from __future__ import annotations

import contextlib
import logging
import math
import queue
import select
import socket
import time
from dataclasses import dataclass

from rto_node.client import RobotinoClient, RobotinoError

from rto_bringup.onboard.sensors import Reading, Sensors, ranges_of_sectors
from telepresence.drive.datagram import MAX_DATAGRAM, Report, encode_report
from telepresence.drive.pilots import Outgoing, Pilots, Request
from telepresence.safety import ROBOTINO, ROBOTINO_LASER, Command, Decision, Odometry, State, VelocityGate
from telepresence.security.robot_key import RobotKey

log = logging.getLogger(__name__)

PERIOD = 0.05
"""Seconds between two decisions."""
SHORTEST_PERIOD = 0.02
"""A new command is decided on at once, but not more often than this [s]."""
ZEROS_TIME = 1.0
"""Seconds for which zeros are sent after the controls were let go: longer than the base's ramp."""
WRITE_TIMEOUT = 0.15
"""Seconds within which the robot's web server must accept a velocity; it is on the same machine."""
FAULT_TIME = 0.5
"""Seconds for which a velocity that the robot's web server did not take is reported as a fault."""
MAX_READINGS = 40
IDLE = (State.NO_COMMAND, State.BLOCKED, State.LIMITED, State.CLEAR)
"""States of the gate that say nothing about the robot itself."""
LOG_PERIOD = 1.0
"""Seconds between two lines about datagrams: whoever sends many does not fill the disk."""


@dataclass
class _Wheels:
    """What was last written, and when zeros are to end [s]."""

    zeros_until: float = -math.inf
    moving: bool = False


class DriveServer:
    """Bound when constructed; `run` serves until `stop`. One thread, but for the sensors'.

    Args:
        robot: The robot's own web server.
        address, port: Where to listen; port 0 takes a free one.
        laser: The robot carries a laser scanner.
        key: The robot's, which pilots must have. Without one whoever reaches the port may drive.
    Raises:
        OSError: The port is taken or the address is not this machine's; the text names both.
        ValueError: `robot` is not an address.
    """

    def __init__(
        self, robot: str, address: str, port: int, *, laser: bool = False, key: RobotKey | None = None
    ) -> None:
        self._client = RobotinoClient(robot, timeout=WRITE_TIMEOUT)
        self._readings: queue.Queue[Reading] = queue.Queue(MAX_READINGS)
        self._sensors = Sensors(robot, laser, self._store)
        self._gate = VelocityGate(ROBOTINO_LASER if laser else ROBOTINO)
        self._pilots = Pilots(key)
        self._log_due, self._unsaid, self._refused = -math.inf, 0, 0
        self._wheels = _Wheels()
        self._odometry: Odometry | None = None
        self._write_problem, self._write_failed = "", -math.inf
        self._reports = 0
        self._stopping = False
        self._waker, self._wake = socket.socketpair()
        self._waker.setblocking(False)
        self._socket = _bind(address, port)
        self.address, self.port = self._socket.getsockname()[:2]

    def run(self) -> int:
        """Serve until `stop`; the exit status."""
        self._sensors.start()
        due, last, known = time.monotonic(), -math.inf, None
        while not self._stopping:
            now = time.monotonic()
            new = self._pilots.command(now)
            urgent = (new is None) != (known is None) or (new is not None and _velocity(new) != _velocity(known))
            if now >= due or (urgent and now - last >= SHORTEST_PERIOD):
                known, last = new, now
                self._tick(now, new)
                due = max(due + PERIOD, now) if now >= due else now + PERIOD
            self._listen(min(due, self._pilots.deadline(), last + SHORTEST_PERIOD if urgent else math.inf))
        if self._wheels.moving:
            self._write((0.0, 0.0, 0.0))
        return 0

    def stop(self) -> None:
        """End `run`; from a signal handler too."""
        self._stopping = True
        with contextlib.suppress(BlockingIOError, OSError):
            self._waker.send(b"x")

    def close(self) -> None:
        self._sensors.close()
        self._client.close()
        for end in (self._socket, self._waker, self._wake):
            end.close()

    def __enter__(self) -> DriveServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- pilots ------------------------------------------------------------------------------------------------------

    def _listen(self, until: float) -> None:
        """Take the datagrams that come until `until` [s], at least those that wait already."""
        timeout = max(0.0, until - time.monotonic())
        select.select([self._socket, self._wake], [], [], timeout)
        for _ in range(100):  # of a flood the rest must wait until the wheels were served
            try:
                datagram, address = self._socket.recvfrom(MAX_DATAGRAM + 1)
            except BlockingIOError:
                return
            except OSError as error:
                # Linux reports here that an earlier datagram reached no program.
                log.debug("a datagram did not arrive: %s", error)
                continue
            for consequence in self._pilots.receive(datagram, address, time.monotonic()):
                if isinstance(consequence, Request):
                    consequence = self._do(consequence)
                self._send(consequence)

    def _do(self, request: Request) -> Outgoing:
        ok, text = True, ""
        if request.what == "stop":
            self._gate.stop(f"{request.session} pressed stop")
            text = "stopped until reset stop"
        elif request.what == "reset stop":
            self._gate.reset_stop()
            text = "let go of the controls once to drive again"
        elif request.what == "reset bumper":
            ok = self._gate.reset_bumper()
            text = "" if ok else "the bumper is still pressed"
        elif request.what == "leave":
            self._pilots.release(request.session)
        self._say(f"{request.what}, asked by {request.session}: {text or ('done' if ok else 'refused')}")
        return self._pilots.answered(request, ok, text)

    def _say(self, text: str) -> None:
        """Log what a datagram caused, a line a second at most."""
        now = time.monotonic()
        if now < self._log_due:
            self._unsaid += 1
            return
        more = f" (and {self._unsaid} lines like this were left out)" if self._unsaid else ""
        self._log_due, self._unsaid = now + LOG_PERIOD, 0
        log.info("%s%s", text, more)

    def _send(self, outgoing: Outgoing) -> None:
        try:
            self._socket.sendto(outgoing.datagram, outgoing.address)
        except OSError as error:
            log.debug("nothing can be sent to %s: %s", outgoing.address, error)

    # --- the robot ---------------------------------------------------------------------------------------------------

    def _store(self, reading: Reading) -> None:  # on the sensors' thread
        with contextlib.suppress(queue.Full):  # nobody decides: nothing moves either
            self._readings.put_nowait(reading)

    def _tick(self, now: float, command: Command | None) -> None:
        while not self._readings.empty():
            self._take(self._readings.get_nowait())
        self._gate.careful = self._pilots.careful
        decision = self._gate.step(now, command, self._odometry)
        given = (decision.vx, decision.vy, decision.wz) if command is not None else (0.0, 0.0, 0.0)
        self._give(now, command, given)
        self._report(now, decision, given, command is not None)
        if self._pilots.refused > self._refused and now >= self._log_due:
            self._say(f"{self._pilots.refused - self._refused} datagrams refused, the last one: {self._pilots.refusal}")
            self._refused = self._pilots.refused

    def _take(self, reading: Reading) -> None:
        self._gate.update_ranges("infrared", reading.stamp, reading.distances)
        self._gate.update_bumper(reading.stamp, reading.bumper)
        if reading.scan is not None:
            self._gate.update_ranges("laser", reading.stamp, ranges_of_sectors(reading.scan))
        self._odometry = Odometry(*reading.pose, reading.stamp)

    def _give(self, now: float, command: Command | None, velocity: tuple[float, float, float]) -> None:
        """Write while somebody drives, zeros for a while after they let go, one zero when they fell silent."""
        wheels = self._wheels
        if command is not None:
            wheels.zeros_until = now + ZEROS_TIME
        elif self._pilots.cut and wheels.moving:
            wheels.zeros_until = -math.inf
        elif now > wheels.zeros_until:
            return
        wheels.moving = command is not None
        self._write(velocity)

    def _write(self, velocity: tuple[float, float, float]) -> None:
        try:
            self._client.drive(*velocity)
            self._write_problem = ""
        except RobotinoError as error:
            if not self._write_problem:
                log.error("%s", error)
            self._write_problem, self._write_failed = str(error), time.monotonic()

    def _report(self, now: float, decision: Decision, given: tuple[float, float, float], commanded: bool) -> None:
        self._reports += 1
        driver = self._pilots.driver
        # What one write met counts for a moment only: nobody writes while nobody drives, and nothing would clear it.
        failed = self._write_problem if now - self._write_failed <= FAULT_TIME else ""
        problem = failed or self._sensors.problem
        for session in self._pilots.sessions:
            state, reason = decision.state, decision.reason
            if problem:
                state, reason = State.FAULT, f"On the robot: {problem}."
            elif driver not in (None, session) and state in IDLE:
                state, reason = State.NO_COMMAND, f"Another pilot drives: {driver}."
            elif not commanded and state in IDLE:
                state, reason = State.NO_COMMAND, self._pilots.problem or "Nobody drives."
            report = Report(
                now,
                self._reports,
                state.value,
                reason,
                given,
                tuple(decision.allowed.tolist()),
                decision.gap,
                -1 if decision.sector is None else decision.sector,
                decision.command_age,
                decision.scanning,
            )
            self._pilots.reported(session, now)
            self._send(session.send(encode_report(report)))


def _velocity(command: Command | None) -> tuple[float, float, float] | None:
    return None if command is None else (command.vx, command.vy, command.wz)


def _bind(address: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    bound = socket.socket(family, socket.SOCK_DGRAM)
    try:
        bound.setblocking(False)
        bound.bind((address, port))
    except OSError as error:
        bound.close()
        raise OSError(error.errno, f"cannot listen on {address}, udp port {port}: {error.strerror}") from error
    return bound
