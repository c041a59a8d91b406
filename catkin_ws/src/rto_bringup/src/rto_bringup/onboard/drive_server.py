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
import time
from dataclasses import dataclass

from rto_node.client import RobotinoClient, RobotinoError

from rto_bringup.onboard.sensors import Reading, Sensors, ranges_of_sectors
from telepresence.drive import server
from telepresence.drive.datagram import Goal
from telepresence.drive.pilots import Command as Requested
from telepresence.drive.pilots import Pilots
from telepresence.drive.server import AT_REST, Outcome
from telepresence.safety import ROBOTINO, ROBOTINO_LASER, Command, Odometry, State, VelocityGate
from telepresence.security.shared_key import SharedKey

log = logging.getLogger(__name__)

ZEROS_TIME = 1.0
"""Seconds for which zeros are sent after the controls were let go: longer than the base's ramp."""
WRITE_TIMEOUT = 0.15
"""Seconds within which the robot's web server must accept a velocity; it is on the same machine."""
FAULT_TIME = 0.5
"""Seconds for which a velocity that the robot's web server did not take is reported as a fault."""
MAX_READINGS = 40


@dataclass
class _Wheels:
    """What was last written, and when zeros are to end [s]."""

    zeros_until: float = -math.inf
    moving: bool = False


class GatedBase(server.Robot):
    """The robot's wheels behind the gate, with the robot's own sensors.

    Args:
        robot: The robot's own web server.
        laser: The robot carries a laser scanner.
    Raises:
        ValueError: `robot` is not an address.
    """

    def __init__(self, robot: str, laser: bool) -> None:
        self._client = RobotinoClient(robot, timeout=WRITE_TIMEOUT)
        self._readings: queue.Queue[Reading] = queue.Queue(MAX_READINGS)
        self._sensors = Sensors(robot, laser, self._store)
        self._gate = VelocityGate(ROBOTINO_LASER if laser else ROBOTINO)
        self._wheels = _Wheels()
        self._odometry: Odometry | None = None
        self._write_problem, self._write_failed = "", -math.inf

    def start(self) -> None:
        self._sensors.start()

    def close(self) -> None:
        self._sensors.close()
        self._client.close()

    def do(self, what: str, who: str) -> tuple[bool, str]:
        if what == "stop":
            self._gate.stop(f"{who} pressed stop")
            return True, "stopped until reset stop"
        if what == "reset stop":
            self._gate.reset_stop()
            return True, "let go of the controls once to drive again"
        if what == "reset bumper" and not self._gate.reset_bumper():
            return False, "the bumper is still pressed"
        return True, ""

    def step(self, now: float, command: Requested | None, goal: Goal | None, pilots: Pilots) -> Outcome:
        while not self._readings.empty():
            self._take(self._readings.get_nowait())
        self._gate.careful = pilots.careful
        decision = self._gate.step(now, command and Command(*command), self._odometry)
        given = (decision.vx, decision.vy, decision.wz) if command is not None else AT_REST
        self._give(now, command is not None, given, pilots.cut)
        # What one write met counts for a moment only: nobody writes while nobody drives, and nothing would clear it.
        failed = self._write_problem if now - self._write_failed <= FAULT_TIME else ""
        problem = failed or self._sensors.problem
        return Outcome(
            State.FAULT.value if problem else decision.state.value,
            f"On the robot: {problem}." if problem else decision.reason,
            given,
            tuple(decision.allowed.tolist()),
            decision.gap,
            -1 if decision.sector is None else decision.sector,
            decision.command_age,
            decision.scanning,
        )

    def end(self) -> None:
        if self._wheels.moving:
            self._write(AT_REST)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _store(self, reading: Reading) -> None:  # on the sensors' thread
        with contextlib.suppress(queue.Full):  # nobody decides: nothing moves either
            self._readings.put_nowait(reading)

    def _take(self, reading: Reading) -> None:
        self._gate.update_ranges("infrared", reading.stamp, reading.distances)
        self._gate.update_bumper(reading.stamp, reading.bumper)
        if reading.scan is not None:
            self._gate.update_ranges("laser", reading.stamp, ranges_of_sectors(reading.scan))
        self._odometry = Odometry(*reading.pose, reading.stamp)

    def _give(self, now: float, commanded: bool, velocity: tuple[float, float, float], cut: bool) -> None:
        """Write while somebody drives, zeros for a while after they let go, one zero when they fell silent."""
        wheels = self._wheels
        if commanded:
            wheels.zeros_until = now + ZEROS_TIME
        elif cut and wheels.moving:
            wheels.zeros_until = -math.inf
        elif now > wheels.zeros_until:
            return
        wheels.moving = commanded
        self._write(velocity)

    def _write(self, velocity: tuple[float, float, float]) -> None:
        try:
            self._client.drive(*velocity)
            self._write_problem = ""
        except RobotinoError as error:
            if not self._write_problem:
                log.error("%s", error)
            self._write_problem, self._write_failed = str(error), time.monotonic()


class DriveServer(server.DriveServer):
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
        self, robot: str, address: str, port: int, *, laser: bool = False, key: SharedKey | None = None
    ) -> None:
        self._base = GatedBase(robot, laser)
        super().__init__(self._base, address, port, key, log.info)

    def __enter__(self) -> DriveServer:
        self._base.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        self._base.close()
