"""The base of a Robotino as the drive server drives it: the only program that commands this robot's wheels, with no
network between it and them but that of a computer that rides on the robot.

What pilots command (`telepresence.drive.server`) in, sensors from the robot's web server in, the gate of
`telepresence.safety` between, velocities to the web server out.

The base brakes in one of two ways: by its own ramp (0.4 m/s²), as long as it gets zeros, or at once, when it gets
nothing for the 200 ms of its own watchdog. A pilot who falls silent gets one zero and then nothing: at rest 0.4 s after
the last command from 0.2 m/s, 0.5 s from 0.35 m/s. Who lets go of the controls gets the ramp down to 0.12 m/s, and
the watchdog ends it.
"""

from __future__ import annotations

import contextlib
import logging
import math
import queue
from dataclasses import dataclass

from rto_bringup.onboard.kept_latches import KeptLatches
from rto_bringup.onboard.laser_beams import ranges_of_beams
from rto_bringup.onboard.sensors import Reading, Sensors
from rto_bringup.onboard.velocity_writer import VelocityWriter
from telepresence.drive.datagram import Goal
from telepresence.drive.pilots import SILENCE, Pilots, PilotVelocity
from telepresence.drive.server import AT_REST, DrivenBase, Outcome
from telepresence.safety import ROBOTINO, ROBOTINO_LASER, Command, Odometry, State, VelocityGate

log = logging.getLogger(__name__)

LATE = 0.12
"""Seconds after a pilot's last velocity, of which there are 20 a second, at which the base begins to brake: two are
missing. One that comes soon after makes it drive on, a few hundredths of a metre per second slower."""
RAMP, TURN_RAMP = 0.4, math.pi
"""The base's own [m/s², rad/s²]: controld3.conf (mirror BusHero/robotino_api2)."""
SLOW, SLOW_TURN = 0.12, 0.5
"""Speeds below which the watchdog may end a gentle stop: nobody feels it [m/s, rad/s]."""
ROBOTS_WATCHDOG = 0.2
"""Seconds without a velocity after which the base stops its motors (wiki.openrobotino.org, Rest api)."""
MAX_READINGS = 40
STAMP_STEP = 1e-6
"""Seconds by which a command's stamp is later than that of the one before, at least."""


@dataclass
class _Wheels:
    """What was last written: the velocity while the robot is driven, and until when it gets zeros [s] after that."""

    velocity: tuple[float, float, float] = AT_REST
    zeros_until: float | None = None


class RobotinoBase(DrivenBase):
    """The robot's wheels behind the gate, with the robot's own sensors, which are read within `with`. One thread, but
    for the sensors' and the writer's.

    Args:
        robot: The robot's own web server.
        laser: The robot carries a laser scanner.
        kept: What was latched in a drive server that died, and is kept for the next one.
    Raises:
        ValueError: `robot` is not an address.
    """

    def __init__(self, robot: str, laser: bool, kept: KeptLatches | None = None) -> None:
        self._writer = VelocityWriter(robot)
        self._readings: queue.Queue[Reading] = queue.Queue(MAX_READINGS)
        self._sensors = Sensors(robot, laser, self._store)
        self._gate = VelocityGate(ROBOTINO_LASER if laser else ROBOTINO, bumper=True)
        self._kept = kept or KeptLatches(None)
        self._gate.restore(self._kept.read())
        self._wheels = _Wheels()
        self._odometry: Odometry | None = None
        self._restarts = 0
        self._newest: PilotVelocity | None = None
        self._stamp = -math.inf
        self._late_at = math.inf

    def __enter__(self) -> RobotinoBase:
        self._sensors.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._sensors.close()
        self._writer.close()

    def do(self, what: str, who: str) -> tuple[bool, str]:
        done = self._do(what, who)
        self._kept.keep(self._gate.latched)
        return done

    def _do(self, what: str, who: str) -> tuple[bool, str]:
        if what == "stop":
            self._gate.stop(f"{who} pressed stop")
            return True, "stopped until reset stop"
        if what == "reset stop":
            self._gate.reset_stop()
            return True, "let go of the controls once to drive again"
        if what == "reset bumper" and not self._gate.reset_bumper():
            return False, "the bumper is still pressed"
        return True, ""

    def step(self, now: float, command: PilotVelocity | None, goal: Goal | None, pilots: Pilots) -> Outcome:
        while not self._readings.empty():
            self._take(self._readings.get_nowait())
        self._kept.keep(self._gate.latched)
        self._gate.careful = pilots.careful
        decision = self._gate.step(now, command and self._ordered(command), self._odometry)
        late = now >= pilots.deadline() - SILENCE + LATE
        given = (decision.vx, decision.vy, decision.wz) if command is not None and not late else AT_REST
        self._give(now, given, late or (command is None and pilots.cut))
        self._late_at = math.inf if command is None or late else pilots.deadline() - SILENCE + LATE
        problem = self._writer.problem(now) or self._sensors.problem
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

    def due(self) -> float:
        return self._late_at

    def end(self) -> None:
        if any(self._wheels.velocity):
            self._write(AT_REST)
            self._writer.finish()
        self._kept.forget()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _store(self, reading: Reading) -> None:  # on the sensors' thread
        with contextlib.suppress(queue.Full):  # nobody decides: nothing moves either
            self._readings.put_nowait(reading)

    def _take(self, reading: Reading) -> None:
        if reading.restarts != self._restarts:
            self._restarts = reading.restarts
            log.warning("the robot's odometry has started again; what was seen before is forgotten")
            self._gate.forget_surroundings()
        self._gate.update_ranges("infrared", reading.stamp, reading.distances)
        self._gate.update_bumper(reading.stamp, reading.bumper)
        if reading.scan is not None:
            self._gate.update_ranges("laser", reading.stamp, ranges_of_beams(reading.scan))
        self._odometry = reading.odometry

    def _ordered(self, command: PilotVelocity) -> Command:
        """Return a pilot's command with a stamp by which the gate takes it for newer than the one before it. It is: by
        its datagram's number. The stamp that came with it is older all the same, when the report was late from which
        the pilot counts."""
        if command is not self._newest:
            self._newest, self._stamp = command, max(command.stamp, self._stamp + STAMP_STEP)
        return Command(*command[:3], self._stamp)

    def _give(self, now: float, velocity: tuple[float, float, float], fast: bool) -> None:
        """Write a velocity as long as the robot is to move, then zeros as long as the base is to brake gently, one at
        least, then nothing.

        Args:
            fast: It is to brake fast.
        """
        wheels = self._wheels
        if any(velocity):
            wheels.velocity, wheels.zeros_until = velocity, None
        elif not any(wheels.velocity):
            return
        elif wheels.zeros_until is None:
            wheels.zeros_until = now if fast else now + gentle_time(*wheels.velocity)
        elif now > wheels.zeros_until:
            wheels.velocity = AT_REST
            return
        self._write(velocity)

    def _write(self, velocity: tuple[float, float, float]) -> None:
        self._writer.write(velocity)


def gentle_time(vx: float, vy: float, wz: float) -> float:
    """Return for how long zeros are written to a base that drives at this velocity [m/s, m/s, rad/s], so that its
    watchdog stops the motors when it has become slow."""
    braking = max((math.hypot(vx, vy) - SLOW) / RAMP, (abs(wz) - SLOW_TURN) / TURN_RAMP)
    return max(0.0, braking - ROBOTS_WATCHDOG)
