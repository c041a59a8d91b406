"""Reaction of the full stack: real wire, real nodes, simulated robot.

A person appears close in front of a driving robot, until the setpoint is down at the speed that the braking law allows
for that distance; and the pilot falls silent, until the setpoint is zero. Moments vary over the periods of all loops.
"""

from __future__ import annotations

import contextlib
import math
import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from report import Row, percentile
from ros_graph import private_master, wait_for

import pepper_sim.simulation
import robotino_sim.simulation
from telepresence.safety import PEPPER, ROBOTINO, RobotProfile
from telepresence.safety.braking import stopping_speed
from telepresence.station import processes

REPETITIONS = 20
LIMIT = 0.35
"""What is asked for [s]."""
GAP = 0.10
"""Distance from the robot's rim to the tip of the person's foot [m]."""
FOOT = (0.170, 0.105)
"""Offset from the middle of the arena's person to the tip of a foot, ahead and aside [m]."""
TOLERANCE = 0.01
"""A setpoint this much above the allowed speed is at it: sensors measure to a centimetre [m/s]."""
FAR_AWAY = (3.2, -2.4)
"""Where the person waits [m]."""


@dataclass(frozen=True)
class Case:
    """One robot with its nodes.

    Args:
        name: For the report.
        profile: What its gate believes.
        speed: Driven when the person appears [m/s].
        simulation: Makes the simulator in this process.
        topic: The pilot's.
        nodes: Command lines for a simulator on a port.
    """

    name: str
    profile: RobotProfile
    speed: float
    simulation: Callable[[], contextlib.AbstractContextManager]
    topic: str
    nodes: Callable[[str], list[list[str]]]


CASES = (
    Case(
        "Pepper",
        PEPPER,
        0.30,
        lambda: pepper_sim.simulation.Simulation(scene="arena", port=0),
        "/cmd_vel",
        lambda port: [["roslaunch", "naoqi_driver_py", "naoqi_driver.launch", f"nao_port:={port}"]],
    ),
    Case(
        "Robotino",
        ROBOTINO,
        0.20,
        lambda: robotino_sim.simulation.Simulation(scene="arena", port=0),
        "/rto3/safe_cmd_vel",
        lambda port: [
            ["rosrun", "rto_node", "rto_node", f"--hostname=127.0.0.1:{port}", "__ns:=/rto3"],
            ["rosrun", "rto_node", "rto_odometry_node", f"--hostname=127.0.0.1:{port}", "__ns:=/rto3"],
            ["rosrun", "rto_safe_teleop", "safe_omni_drive", "__ns:=/rto3", "_careful:=false"],
        ],
    ),
)


def run_rows(repetitions: int = REPETITIONS) -> list[Row]:
    """p50 and p95 of both reactions of both robots, against the limit."""
    rows = []
    for case in CASES:
        appeared, ceased = measure(case, repetitions)
        for what, times in (("person appears to allowed speed", appeared), ("commands cease to zero", ceased)):
            rows += [
                Row(f"{case.name}: {what}, p{percent}", percentile(times, percent), LIMIT, "s", "limit")
                for percent in (50, 95)
            ]
    return rows


def measure(case: Case, repetitions: int = REPETITIONS) -> tuple[list[float], list[float]]:
    """Seconds from the person's appearing to the allowed speed, and from the last command to zero."""
    random.seed(1)
    with private_master() as environment, case.simulation() as simulation:
        stage = Stage(case, simulation)
        with (
            running(case.nodes(simulation.url.rpartition(":")[2]), environment),
            Pilot(case.topic, environment) as pilot,
        ):
            stage.drive_until(pilot, case.speed)
            results = [stage.repeat(pilot) for _ in range(repetitions)]
    return [appeared for appeared, _ in results], [ceased for _, ceased in results]


class Stage:
    """The robot, its setpoints, and the person."""

    def __init__(self, case: Case, simulation) -> None:
        self._case = case
        self._world, self._robot = simulation.world, simulation.robot
        self._person = self._world.model.body("person").mocapid[0]
        self._setpoints: list[tuple[float, float]] = []
        self._record("set_velocity", lambda vx, vy, wz: math.copysign(math.hypot(vx, vy), vx))
        if hasattr(self._robot, "stop_move"):
            self._record("stop_move", lambda **_: 0.0)
        rim = float(case.profile.outline.corners[:, 0].max()) + case.profile.outline.radius
        self._ahead = rim + GAP + FOOT[0]
        limits = case.profile.limits
        self._allowed = float(stopping_speed(GAP - limits.margin_ahead, limits.reaction, limits.braking))
        self.place(*FAR_AWAY)

    def _record(self, method: str, speed: Callable[..., float]) -> None:
        """Note the time and speed of every call of a method of the robot."""
        call = getattr(self._robot, method)

        def noted(*arguments: object, **named: object) -> object:
            self._setpoints.append((time.monotonic(), speed(*arguments, **named)))
            return call(*arguments, **named)

        setattr(self._robot, method, noted)

    def place(self, x: float, y: float) -> None:
        with self._world.locked() as data:
            data.mocap_pos[self._person][:2] = x, y
            data.mocap_quat[self._person] = 0.0, 0.0, 0.0, 1.0  # facing -x, which is where the robot comes from

    def drive_until(self, pilot: Pilot, speed: float) -> None:
        """Drive straight on until the setpoint is the wanted one."""
        pilot.drive(speed)
        wait_for(lambda: self._setpoints and abs(self._setpoints[-1][1] - speed) < 0.01, f"a setpoint of {speed} m/s")

    def repeat(self, pilot: Pilot) -> tuple[float, float]:
        """One of each, and back to about where it began."""
        begin = self._robot.truth()[0]
        self.drive_until(pilot, self._case.speed)
        time.sleep(random.uniform(0.5, 0.7))
        x, y = self._robot.truth()[:2]
        self.place(x + self._ahead, y - FOOT[1])
        appeared = self._time_until(time.monotonic(), self._allowed + TOLERANCE)
        # It may now slide past the foot, at the allowed speed: that is no stop.
        self.place(*FAR_AWAY)
        time.sleep(1.0)  # until the gate has looked through the place where the person was
        back = -min(self._case.speed, self._case.profile.limits.escape_speed)
        self.drive_until(pilot, back)
        wait_for(lambda: self._robot.truth()[0] < begin + 0.05, "the way back")
        time.sleep(random.uniform(0.0, 0.1))
        ceased = self._time_until(pilot.cease(), 1e-3)
        return appeared, ceased

    def _time_until(self, begin: float, speed: float) -> float:
        """Seconds until the setpoint is no faster than `speed`."""

        def found() -> float | None:
            return next((at for at, v in list(self._setpoints) if at > begin and abs(v) <= speed), None)

        wait_for(lambda: found() is not None, f"a setpoint of at most {speed:.2f} m/s", timeout=10.0)
        return found() - begin


class Pilot:
    """A node that publishes a velocity twenty times a second, in the namespace of its topic."""

    def __init__(self, topic: str, environment: dict[str, str]) -> None:
        self._process = processes.start(
            [sys.executable, str(Path(__file__).with_name("pilot_node.py")), topic],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Pilot:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.stdin.close()
        processes.end(self._process)

    def drive(self, vx: float, vy: float = 0.0, wz: float = 0.0) -> None:
        """Publish this from now on [m/s, m/s, rad/s]."""
        self._ask(f"{vx} {vy} {wz}")

    def reset_bumper(self) -> bool:
        """False if there is no such service, or the bumper is still pressed."""
        return self._ask("reset").strip() == "True"

    def cease(self) -> float:
        """Publish no more; the time of the last command [s, monotonic]."""
        return float(self._ask("cease"))

    def _ask(self, line: str) -> str:
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline()


@contextlib.contextmanager
def running(commands: list[list[str]], environment: dict[str, str]) -> Iterator[None]:
    """These programs run meanwhile."""
    quiet = dict(stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    started = []
    try:
        for command in commands:
            started.append(processes.start(command, env=environment, **quiet))
        yield
    finally:
        for process in reversed(started):
            processes.end(process)
