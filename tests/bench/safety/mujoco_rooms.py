"""Scenarios of the safety benchmark in MuJoCo: the same places, pilots and counting, the real wire and nodes between.

The fast runner computes sensors and motion itself and calls the gate. Here the robot is the simulated Robotino behind
REST, its readings come through rto_node, the gate is safe_omni_drive, and time is real. What both say of the same
scenarios must agree. Things that stand only.
"""

from __future__ import annotations

import math
import time

import mujoco
import numpy as np
from report import Row
from ros_graph import private_master
from safety.gates import OurGate
from safety.geometry import Hull
from safety.pilots import Pilots
from safety.reaction import Pilot, running
from safety.robots import INFRARED_ROBOT, TICK
from safety.run import SUBSTEPS, Outcome, Run, run
from safety.worlds import Batch, Place, make_place

from robotino_sim.simulation import SimulatedRobotino
from telepresence.safety import Command, Odometry, State
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import ROBOT_GROUP
from telepresence.sim.world import World

SEED = 9004
SCENARIOS = 6
SECONDS = 20.0
SPEED = 0.20
"""[m/s]"""
TOUCH = 0.004
"""Bodies that push each other in MuJoCo keep this much between them [m]."""
HEIGHT = 0.5
"""Height of everything [m]."""
SETPOINT_HOLDS = 0.5
"""A setpoint older than this is none: the robot has stopped on its own [s]."""


def run_rows(scenarios: int = SCENARIOS, seconds: float = SECONDS) -> list[Row]:
    """The full stack's figures against those of the fast runner."""
    wired = [drive_through_wire(number, seconds) for number in range(scenarios)]
    fast = [
        run(INFRARED_ROBOT, OurGate, seed=SEED, first=number, count=1, speed=SPEED, seconds=seconds, people=0)
        for number in range(scenarios)
    ]
    name = "2-D runner"
    return [
        Row("MuJoCo: command passed", _passed(wired), _passed(fast), "%", name),
        Row("MuJoCo: scenarios without a collision", _clean(wired), _clean(fast), f"of {scenarios}", name),
        Row("MuJoCo: way driven", _sum(wired, "driven"), _sum(fast, "driven"), "m", name),
        Row("MuJoCo: least gap, median", _gap(wired), _gap(fast), "m", name),
    ]


def drive_through_wire(number: int, seconds: float) -> Outcome:
    """One scenario in real time."""
    place = make_place(SEED, number, INFRARED_ROBOT.profile.outline.outer_radius, people=0)
    robot = SimulatedRobotino()
    world = World(_scene(place, robot), seed=SEED)
    cameras = Cameras(world)
    try:
        robot.enter(world, cameras, SEED)
        world.start()
        robot.serve("127.0.0.1", 0)
        return _drive(place, number, robot, seconds)
    finally:
        robot.close()
        cameras.close()
        world.close()


def _drive(place: Place, number: int, robot: SimulatedRobotino, seconds: float) -> Outcome:
    host = robot.urls[0].rpartition("/")[2]
    nodes = [
        ["rosrun", "rto_node", "rto_node", f"--hostname={host}", "__ns:=/rto3"],
        ["rosrun", "rto_node", "rto_odometry_node", f"--hostname={host}", "__ns:=/rto3"],
        ["rosrun", "rto_safe_teleop", "safe_omni_drive", "__ns:=/rto3", "_careful:=false"],
    ]
    with private_master() as environment, running(nodes, environment):
        with Pilot("/rto3/safe_cmd_vel", environment) as pilot:
            gate = WiredGate(robot, pilot)
            gate.wait_until_it_drives()
            batch = Batch([place], SEED * 1000 + number)
            radius = INFRARED_ROBOT.profile.outline.outer_radius
            pilots = Pilots(batch, number, SPEED, radius, SEED * 1000 + number)
            return WiredRun(gate, batch, pilots, number).drive(seconds)


class WiredGate:
    """Nodes and robot seen as a gate: commands go to the topic, the setpoint comes from the robot."""

    def __init__(self, robot: SimulatedRobotino, pilot: Pilot) -> None:
        self.robot, self._pilot = robot.robot, pilot
        self._setpoint, self._set_at = (0.0, 0.0, 0.0), -math.inf
        call = self.robot.set_velocity

        def noted(vx: float, vy: float, wz: float) -> None:
            self._setpoint, self._set_at = (vx, vy, wz), time.monotonic()
            call(vx, vy, wz)

        self.robot.set_velocity = noted

    def wait_until_it_drives(self, timeout: float = 30.0) -> None:
        """Zeros are commanded until they come through: all nodes are up then."""
        self._pilot.drive(0.0)
        deadline = time.monotonic() + timeout
        while self._set_at == -math.inf:
            if time.monotonic() > deadline:
                raise RuntimeError(f"no velocity reached the robot within {timeout:.0f} s")
            time.sleep(0.05)

    def sense(self, *_: object) -> None:
        """The robot has sensors of its own."""

    def bump(self, place: int, now: float, pressed: bool, bearing: float | None) -> None:
        if not pressed:
            self._pilot.reset_bumper()

    def tick(self, now: float, place: int, command: Command | None, fresh: bool, odometry: Odometry) -> tuple:
        if fresh and command is not None:
            self._pilot.drive(command.vx, command.vy, command.wz)
        return self._setpoint if time.monotonic() - self._set_at < SETPOINT_HOLDS else (0.0, 0.0, 0.0)

    def swing(self, place: int) -> float:
        return 0.0

    def state(self, place: int) -> State:
        return State.CLEAR


class WiredRun(Run):
    """A `Run` with the robot's own motion and sensors, in real time."""

    def __init__(self, gate: WiredGate, batch: Batch, pilots: Pilots, number: int) -> None:
        super().__init__(INFRARED_ROBOT, gate, batch, pilots, (SEED, number))
        hull = INFRARED_ROBOT.hull
        self.hull = Hull(hull.corners, hull.radius + TOUCH)
        self._due = time.monotonic()

    def _sense(self, tick: int, now: float) -> None:
        pass

    def _move(self, dt: float) -> None:
        self._due += TICK / SUBSTEPS
        time.sleep(max(0.0, self._due - time.monotonic()))
        x, y, _, _, _, yaw = self.gate.robot.truth()
        moved = np.array([x, y]) - self.pose[0, :2]
        c, s = math.cos(yaw), math.sin(yaw)
        turned = math.remainder(yaw - self.pose[0, 2], math.tau)
        self.velocity[0] = (c * moved[0] + s * moved[1]) / dt, (c * moved[1] - s * moved[0]) / dt, turned / dt
        self.out.driven[0] += math.hypot(*moved)
        self.pose[0] = x, y, yaw


def _scene(place: Place, robot: SimulatedRobotino) -> mujoco.MjSpec:
    """The place as MuJoCo has it, in the same coordinates."""
    spec = mujoco.MjSpec()
    solid = dict(contype=1, conaffinity=1)
    body = spec.worldbody
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(10.0, 10.0, 0.1), contype=1, conaffinity=5)
    half = 0.5 * HEIGHT
    for x, y, radius, _ in place.circles:
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=(radius, half, 0.0), pos=(x, y, half), **solid)
    for ax, ay, bx, by, _ in place.segments:
        angle = 0.5 * math.atan2(by - ay, bx - ax)
        size = (0.5 * math.hypot(bx - ax, by - ay), 0.002, half)
        middle = (0.5 * (ax + bx), 0.5 * (ay + by), half)
        turn = (math.cos(angle), 0.0, 0.0, math.sin(angle))
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=middle, quat=turn, **solid)
    x, y, yaw = place.start
    model = robot.model
    turn = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
    spawn = body.add_site(name=model.spawn, pos=(x, y, 0.0), quat=turn)
    child = model.load()
    for geom in child.geoms:
        geom.group = ROBOT_GROUP
    spec.attach(child, prefix=model.prefix, site=spawn)
    return spec


def _sum(outcomes: list[Outcome], name: str) -> float:
    return float(sum(getattr(outcome, name).sum() for outcome in outcomes))


def _passed(outcomes: list[Outcome]) -> float:
    return 100.0 * _sum(outcomes, "passed") / _sum(outcomes, "asked")


def _clean(outcomes: list[Outcome]) -> float:
    return float(sum(not outcome.hits.any() for outcome in outcomes))


def _gap(outcomes: list[Outcome]) -> float:
    return float(np.median([outcome.gap.min() for outcome in outcomes]))
