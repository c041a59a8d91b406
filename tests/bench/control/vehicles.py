"""The robots of the control benchmark in their simulated worlds, behind one face, stepped as fast as possible.

Each is the simulator's own robot below its wire: its ramps, watchdog, odometry and sensor noise are those that drivers
meet. What is counted (energy, slip, contacts, falls) comes from the physics.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import mujoco
import numpy as np

from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from robotino_sim.models import robotino_model
from robotino_sim.robot import Robotino
from telepresence.safety import PEPPER, ROBOTINO, RobotProfile, VelocityGate
from telepresence.sim.scene import RobotModel, build_world
from telepresence.sim.simulated_robot import read_pose
from telepresence.sim.walker.body import walker_model
from telepresence.sim.walker.gait import GAITS, HEIGHT
from telepresence.sim.walker.kinematics import LEGS
from telepresence.sim.walker.robot import Walker
from telepresence.sim.world import TICK, World

SAMPLE = 0.02
"""Slip and contacts are taken this often [s]."""
SLIDING = 0.02
"""Slower than this a wheel or foot grips [m/s]."""
QUIET = 1.0
"""A touch within this time of the last one is the same contact [s]."""
FALLEN = math.radians(30.0)

Pose = tuple[float, float, float]


class Vehicle(ABC):
    """One robot in a world of its own.

    Args:
        scene: Name of the scene.
        start: x, y [m], yaw [rad] in the world.
        seed: Of the world: noise, wheels, joints; and of how rough ground lies under the robot.
    Attributes:
        work: Of the drives [J]; what comes back while braking is lost.
        slip: How far wheels or feet slid over the ground [m].
        contacts: Times that the body touched something.
        impact: Fastest speed at such a touch [m/s].
        fell: The body was tilted by more than 30 degrees.
    """

    label: str
    profile: RobotProfile | None = None
    """None for a robot that the gate does not know."""
    speed: float
    turn: float
    """Speeds at which the pilot drives [m/s, rad/s]."""
    front: float
    """Distance from base_link to the body's foremost point [m]."""
    height = 0.0
    """Height of the model's root above the ground [m]."""

    def __init__(self, scene: str, start: Pose, seed: int) -> None:
        model = self._model()
        self.world = build_world(scene, [model], seed)
        self._prefix = model.prefix
        self.work = self.slip = self.impact = 0.0
        self.contacts = 0
        self.fell = False
        self._quiet_until = -1.0
        self._speed_before = 0.0
        self._place(start, seed)
        self._enter(self.world, seed)
        m = self.world.model
        own = {b for b in range(m.nbody) if m.body(b).name.startswith(self._prefix)}
        self._body = np.array([m.geom_bodyid[g] in own and not self._is_foot(m, g) for g in range(m.ngeom)])
        self._mine = np.array([m.geom_bodyid[g] in own for g in range(m.ngeom)])
        self.world.every(TICK, self._count_work)
        self.world.every(SAMPLE, self._sample)

    def step(self, seconds: float) -> None:
        self.world.step(round(seconds / TICK))

    def truth(self) -> Pose:
        """Where it really is: x, y [m], yaw [rad] in the world."""
        pose = read_pose(self.world, self._prefix)
        return pose.x, pose.y, pose.yaw

    def close(self) -> None:
        self.world.close()

    @abstractmethod
    def command(self, vx: float, vy: float, wz: float) -> None: ...

    @abstractmethod
    def odometry(self) -> Pose: ...

    def report(self, gate: VelocityGate, now: float) -> None:
        """Give the gate what the range sensors and bumpers say."""
        raise ValueError(f"{self.label} has no range sensors, so there is nothing to gate it by: drive it without")

    @abstractmethod
    def _model(self) -> RobotModel: ...

    @abstractmethod
    def _enter(self, world: World, seed: int) -> None: ...

    @abstractmethod
    def _is_foot(self, model: mujoco.MjModel, geom: int) -> bool: ...

    @abstractmethod
    def _done(self, data: mujoco.MjData) -> float:
        """Work of the drives during the last tick, at least 0 [J]."""

    @abstractmethod
    def _sliding(self, data: mujoco.MjData) -> float:
        """Speed of wheels or feet over the ground [m/s]."""

    def _place(self, start: Pose, seed: int) -> None:
        """The robot's initial state, so that a restart leads back to it."""
        model = self.world.model
        x, y, yaw = start
        lift = 0.0
        if model.nhfield:
            rows, columns = int(model.hfield_nrow[0]), int(model.hfield_ncol[0])
            ground = model.hfield_data.reshape(rows, columns)
            shift = np.random.default_rng([seed, 1]).integers(0, (rows, columns))
            ground[:] = np.roll(ground, shift, (0, 1))
            lift = float(model.hfield_size[0][2])
        root = int(model.joint(self._prefix + "root").qposadr[0])
        model.qpos0[root : root + 7] = x, y, self.height + lift, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        self.world.reset()

    def _count_work(self, now: float) -> None:
        with self.world.locked() as data:
            self.work += self._done(data)

    def _sample(self, now: float) -> None:
        with self.world.locked() as data:
            sliding = self._sliding(data)
            if sliding > SLIDING:
                self.slip += sliding * SAMPLE
            if self._touches(data):
                if now > self._quiet_until:
                    self.contacts += 1
                    self.impact = max(self.impact, self._speed_before)
                self._quiet_until = now + QUIET
        pose = read_pose(self.world, self._prefix)
        self._speed_before = math.hypot(*pose.velocity[:2])
        self.fell = self.fell or math.cos(pose.roll) * math.cos(pose.pitch) < math.cos(FALLEN)

    def _touches(self, data: mujoco.MjData) -> bool:
        pairs = data.contact.geom[: data.ncon]
        if not len(pairs):
            return False
        return bool((self._body[pairs].any(axis=1) & ~self._mine[pairs].all(axis=1)).any())


class _Wheeled(Vehicle):
    """A vehicle on the drive of `telepresence.sim.base`: three servos that push the body along x and y and turn it."""

    _owned = math.inf  # energy of motion and height after the last tick [J]

    def _is_foot(self, model: mujoco.MjModel, geom: int) -> bool:
        return int(model.geom_contype[geom]) == 4

    def _servos(self) -> slice:
        first = self.world.model.actuator(self._prefix + "drive_x").id
        return slice(first, first + 3)

    def _done(self, data: mujoco.MjData) -> float:
        """What the robot has gained in motion and height: its wheels roll without loss, and nothing else moves.

        The servos' force would not do: they reach a new speed within a physics step, and its reading is the first
        instant's.
        """
        mujoco.mj_energyPos(self.world.model, data)
        mujoco.mj_energyVel(self.world.model, data)
        before, self._owned = self._owned, float(data.energy.sum())
        return max(0.0, self._owned - before)

    def _sliding(self, data: mujoco.MjData) -> float:
        servos = self._servos()
        return float(np.hypot(*(data.ctrl[servos] - data.actuator_velocity[servos])[:2]))


class PepperVehicle(_Wheeled):
    """Pepper, without NAOqi's own protection, so that the gate is what differs."""

    label, profile, speed, turn, front = "Pepper", PEPPER, 0.25, 0.5, 0.175
    _LASERS = (("front laser", "Front", 0.0), ("left laser", "Left", 1.75728), ("right laser", "Right", -1.75728))
    _BUMPERS = (("FrontLeft", 1.054), ("FrontRight", -1.054), ("Back", math.pi))

    def _model(self) -> RobotModel:
        return pepper_model()

    def _enter(self, world: World, seed: int) -> None:
        self.robot = Pepper(world, None, seed=seed)
        self.robot.security.enabled = False
        self._told: dict[str, np.ndarray] = {}
        self._sonar_due = 0.0

    def command(self, vx: float, vy: float, wz: float) -> None:
        self.robot.set_velocity(vx, vy, wz)

    def odometry(self) -> Pose:
        return self.robot.snapshot().odometry

    def report(self, gate: VelocityGate, now: float) -> None:
        snapshot = self.robot.snapshot()
        for name, side, heading in self._LASERS:
            # Each measurement once: the gate wants to see far returns again before it believes them.
            if snapshot.laser[side] is self._told.get(name):
                continue
            self._told[name] = snapshot.laser[side]
            c, s = math.cos(heading), math.sin(heading)
            points = snapshot.laser[side] @ np.array(((c, s), (-s, c))) + PEPPER.source(name).origins[0]
            gate.update_range_points(name, now, points)
        if now >= self._sonar_due - 1e-9:
            self._sonar_due = now + PEPPER.source("front sonar").period
            gate.update_ranges("front sonar", now, [snapshot.sonar["Front"]])
            gate.update_ranges("back sonar", now, [snapshot.sonar["Back"]])
        pressed = [bearing for name, bearing in self._BUMPERS if snapshot.bumpers[name]]
        gate.update_bumper(now, bool(pressed), pressed[0] if pressed else None)


class RobotinoVehicle(_Wheeled):
    label, profile, speed, turn, front = "Robotino", ROBOTINO, 0.20, 0.5, ROBOTINO.outline.radius

    def _model(self) -> RobotModel:
        return robotino_model()

    def _enter(self, world: World, seed: int) -> None:
        self.robot = Robotino(world, None, seed=seed)

    def command(self, vx: float, vy: float, wz: float) -> None:
        self.robot.set_velocity(vx, vy, wz)

    def odometry(self) -> Pose:
        odometry = self.robot.snapshot().odometry
        return odometry.x, odometry.y, odometry.phi

    def report(self, gate: VelocityGate, now: float) -> None:
        snapshot = self.robot.snapshot()
        gate.update_ranges("infrared", now, snapshot.distances)
        gate.update_bumper(now, snapshot.bumper)


class WalkerVehicle(Vehicle):
    """The walker; it has no range sensors, so no gate. Its own steering is off: the strategy steers."""

    turn, front, height = 0.3, 0.26, HEIGHT + 0.002
    gait: str

    def _model(self) -> RobotModel:
        return walker_model()

    def _enter(self, world: World, seed: int) -> None:
        self.robot = Walker(world, None, seed=seed, gait=self.gait, hold_heading=False)
        self._feet = [world.model.geom(f"{self._prefix}{leg}_foot").id for leg in LEGS]
        joint = [world.model.joint(i).name for i in range(world.model.njnt)]
        legs = [n for n in joint if n.startswith(self._prefix) and not n.endswith("root")]
        self._dofs = np.array([world.model.joint(n).dofadr[0] for n in legs])

    def _is_foot(self, model: mujoco.MjModel, geom: int) -> bool:
        return model.geom(geom).name.endswith("_foot")

    def command(self, vx: float, vy: float, wz: float) -> None:
        self.robot.set_velocity(vx, vy, wz)

    def odometry(self) -> Pose:
        return self.robot.snapshot().odometry

    def _done(self, data: mujoco.MjData) -> float:
        """Torque times speed of every joint."""
        return float(np.maximum(data.qfrc_actuator[self._dofs] * data.qvel[self._dofs], 0.0).sum()) * TICK

    def _sliding(self, data: mujoco.MjData) -> float:
        """Mean over the feet that touch the ground, each at its lowest point."""
        model = self.world.model
        pairs = data.contact.geom[: data.ncon]
        speeds = []
        velocity = np.zeros(6)
        for foot in self._feet:
            if (pairs == foot).any():
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, foot, velocity, 0)
                radius = float(model.geom_size[foot][0])
                speeds.append(math.hypot(velocity[3] - velocity[1] * radius, velocity[4] + velocity[0] * radius))
        return float(np.mean(speeds)) if speeds else 0.0


class TrotVehicle(WalkerVehicle):
    label, gait, speed = "Walker, trot", "trot", GAITS["trot"].cruise


class CrawlVehicle(WalkerVehicle):
    label, gait, speed = "Walker, crawl", "crawl", GAITS["crawl"].cruise


VEHICLES: dict[str, type[Vehicle]] = {
    "pepper": PepperVehicle,
    "robotino": RobotinoVehicle,
    "trot": TrotVehicle,
    "crawl": CrawlVehicle,
}
