"""Pepper in the simulated world: setpoints in, snapshots out. SI units, no NAOqi words.

Conventions: x forward, y left, z up, counter-clockwise positive (REP 103). Methods may be called from any thread;
futures are completed outside the world's lock, on the thread that steps the world.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Future

import mujoco
import numpy as np

from pepper_sim.body.charging_contacts import ChargingContacts
from pepper_sim.body.collision_protection import SecurityZone
from pepper_sim.body.consent import OwnerConsent
from pepper_sim.body.description import (
    ACC_THETA,
    ACC_XY,
    BRAKING,
    EYES,
    JOINTS,
    LIMITS,
    MAX_THETA,
    MAX_XY,
    SCREEN_HEIGHT,
    SCREEN_WIDTH,
    JointLimits,
)
from pepper_sim.body.frames import ROOT, Frames
from pepper_sim.body.inertial import InertialSensors
from pepper_sim.body.joints import JointMotion
from pepper_sim.body.lights import Lights
from pepper_sim.body.motion import BaseMotion
from pepper_sim.body.postures import STAND
from pepper_sim.body.power import PERIOD as POWER_PERIOD
from pepper_sim.body.power import Power
from pepper_sim.body.readings import Readings
from pepper_sim.body.sensors import Sensors
from pepper_sim.body.state import Snapshot
from pepper_sim.body.velocity_orders import VelocityOrders
from pepper_sim.models import PREFIX
from telepresence.geometry import Velocity, require_finite, roll_pitch_yaw
from telepresence.sim.base import BaseLimits, PlanarBase
from telepresence.sim.camera import Cameras, Feed
from telepresence.sim.world import TICK, World

CAMERAS = ("CameraTop", "CameraBottom", "CameraDepth")
STEREO_CAMERA = "CameraStereo"
FALLEN_TILT = math.radians(30.0)

_DARK = np.zeros((SCREEN_HEIGHT, SCREEN_WIDTH, 3), np.uint8)


class Pepper:
    """One Pepper of a world. It starts awake: stiff, standing, at the origin of its odometry."""

    JOINTS: tuple[str, ...] = JOINTS
    LIMITS: Mapping[str, JointLimits] = LIMITS

    def __init__(
        self,
        world: World,
        cameras: Cameras | None,
        prefix: str = PREFIX,
        seed: int = 0,
        owner_consents: bool = False,
    ) -> None:
        """
        Args:
            world: Built with `pepper_sim.models.pepper_model(prefix)` among its robots.
            cameras: Renders this world's cameras; without it the robot has no pictures and its tablet stays dark.
            prefix: Prefix of this robot's names in the world.
            seed: Seed of the sensors' noise, together with the world's seed.
            owner_consents: Programs may switch safety reflexes off; see `OwnerConsent`.
        """
        model = world.model
        self.world = world
        self.prefix = prefix
        self.cameras: dict[str, tuple[str, ...]] = {name: (prefix + name,) for name in CAMERAS}
        """Name of a camera -> its cameras in the world: two for the stereo camera, left and right eye."""
        if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, prefix + next(iter(EYES))) >= 0:
            self.cameras[STEREO_CAMERA] = tuple(prefix + name for name in EYES)
        self._cameras = cameras
        self.lights = Lights(world, prefix)
        self._rng = world.rng(f"{prefix}{seed}")
        self._root = model.joint(prefix + "root")
        self._pose = slice(self._root.qposadr[0], self._root.qposadr[0] + 7)
        self._frames = Frames(model, prefix)
        self._inertial = InertialSensors(model, prefix, self._frames, self._rng)
        self._base = PlanarBase(
            model, prefix, BaseLimits(MAX_XY, MAX_THETA, ACC_XY, ACC_THETA), BRAKING, world.rng(prefix + "odometry")
        )
        self.security = SecurityZone()
        self.fall_manager = self.diagnosis_effect = self.push_recovery = True
        """Whether a fall takes the joints' stiffness, a faulty device keeps the robot from waking up, and the base
        gives way to a push."""
        self.smart_stiffness = True
        """Whether motors save power while nothing moves. What they can hold against a person's hand stays the same."""
        self.consent = OwnerConsent(owner_consents, self._switch_reflexes_on)
        self._motion = BaseMotion(self._base, self.security, world.post)
        self._orders = VelocityOrders()
        self._joints = JointMotion(model, prefix, world.post)
        self._power = Power()
        self._fallen = False
        self._snapshot: tuple[int, Snapshot] | None = None
        self._contacts = ChargingContacts(model, prefix)
        self._held: set[str] = set()
        self._sensors = Sensors(world, prefix, self._add_obstacles, self._rng)
        self._readings = Readings(
            world, self._joints, self._base, self._motion, self._inertial, self._sensors, self._power
        )
        world.on_reset(self._reset)
        world.on_close(self._close)
        world.every(TICK, self._tick)
        world.every(0.1, self._check_fallen)
        world.every(POWER_PERIOD, self._update_power)
        with world.locked() as data:
            self._reset()
            mujoco.mj_forward(model, data)

    # --- base --------------------------------------------------------------------------------------------------------

    @property
    def base_limits(self) -> BaseLimits:
        """Top speeds and accelerations of the base; assign other limits to change them."""
        return self._base.limits

    @base_limits.setter
    def base_limits(self, limits: BaseLimits) -> None:
        values = (limits.max_xy, limits.max_theta, limits.acc_xy, limits.acc_theta)
        if not all(math.isfinite(value) and value > 0.0 for value in values):
            raise ValueError(f"base limits must be positive numbers, got {limits}")
        self._base.limits = limits

    @property
    def newest_command(self) -> object:
        """Stands for the base's newest command; another one as soon as somebody else commands it."""
        return self._orders.newest

    def set_velocity(self, vx: float, vy: float, wz: float) -> object:
        """Drive until the next call, within the base's limits. It never waits: during a tick the velocity is kept for
        whoever has the world next, and nobody sees the robot before it counts.

        Args:
            vx, vy: Forward and left in base_footprint [m/s].
            wz: Counter-clockwise [rad/s].
        Returns:
            What stands for this command, see `newest_command`.
        Raises:
            ValueError: A value is not finite.
        """
        require_finite("velocity", (vx, vy, wz))
        command = self._orders.add(Velocity(vx, vy, wz))
        with self.world.locked_if_free() as held:
            if held:
                self._obey()
        return command

    def replace_velocity(self, command: object, vx: float, vy: float, wz: float) -> object | None:
        """Drive as `set_velocity` does, unless somebody has commanded the base since `command`. It may wait for a tick.

        Returns:
            What stands for this command; None if somebody has, and nothing was done.
        Raises:
            ValueError: A value is not finite.
        """
        require_finite("velocity", (vx, vy, wz))
        with self.world.locked():
            replacing = self._orders.replace(command, Velocity(vx, vy, wz))
            self._obey()
        return replacing

    def move_to(self, waypoints: Sequence[tuple[float, float, float]], *, duration: float | None = None) -> Future:
        """Drive through `waypoints` and stop in the last one.

        Args:
            waypoints: (x, y, theta) [m, m, rad] in base_footprint as it is now, by odometry.
            duration: Time to take [s]; as fast as the limits allow if it is shorter or None.
        Returns:
            Future: True when the last waypoint is reached, False when the move was refused, interrupted or blocked.
        Raises:
            ValueError: No waypoint, or a value is not finite.
        """
        if not waypoints:
            raise ValueError("move_to needs at least one waypoint")
        for waypoint in waypoints:
            require_finite("waypoint", waypoint)
        if duration is not None and not (math.isfinite(duration) and duration >= 0.0):
            raise ValueError(f"the duration must be a positive number of seconds, got {duration}")
        with self.world.locked():
            self._obey()
            self._orders.supersede()
            future = self._motion.move_to([(float(x), float(y), float(t)) for x, y, t in waypoints], duration)
            self._check_able()
            self._snapshot = None
        return future

    def stop_move(self, *, abrupt: bool = False) -> Future:
        """End every motion of the base. The future is done when the wheels stand still."""
        with self.world.locked():
            self._obey()
            self._snapshot = None
            self._orders.supersede()
            return self._motion.stop(abrupt)

    @property
    def can_drive(self) -> bool:
        """Whether the robot stands on stiff legs, so that the base can move."""
        with self.world.locked():
            return not (self._fallen or self._joints.legs_limp or "stiffness" in self._held)

    def hold_base(self, cause: str, held: bool) -> None:
        """Refuse every motion of the base because of `cause`, or no longer because of that: "charging" on the station,
        "stiffness" at rest and on the way there and back.
        """
        with self.world.locked():
            self._obey()
            (self._held.add if held else self._held.discard)(cause)
            self._check_able()

    # --- joints ------------------------------------------------------------------------------------------------------

    def set_angles(self, angles: Mapping[str, float], speeds: Mapping[str, float]) -> None:
        """Slew joints to `angles` [rad] at `speeds` [rad/s] (top speed where none is given); clipped to the limits.

        Raises:
            ValueError: Unknown joint or a value that is not finite.
        """
        with self.world.locked():
            self._joints.set_angles(angles, speeds)

    def follow(self, knots: Mapping[str, Sequence[tuple[float, float]]]) -> Future:
        """Move joints smoothly through knots.

        Args:
            knots: Joint -> (seconds from now, angle [rad]), times positive and rising.
        Returns:
            Future: True when done, False when another command took one of the joints; cancelling it stops them.
        Raises:
            ValueError: Unknown joint, no knots, times that do not rise, or a value that is not finite.
        """
        with self.world.locked():
            return self._joints.follow(knots, self.world.time)

    def stop_joints(self, joints: Sequence[str] = JOINTS) -> None:
        """Hold joints at their present setpoints; trajectories that use them end with False."""
        with self.world.locked():
            self._joints.stop(joints)

    def set_stiffness(self, stiffness: Mapping[str, float]) -> None:
        """Set the share of torque the motors may use, 0 limp ... 1 full. Legs at 0 are held by their brakes."""
        with self.world.locked():
            self._obey()
            self._joints.set_stiffness(stiffness)
            self._check_able()
            self._snapshot = None

    def ramp_stiffness(self, stiffness: Mapping[str, float], duration: float) -> Future:
        """Change the share of torque of joints evenly over `duration` [s].

        Returns:
            Future: True when it is reached, False when `set_stiffness` came in between; cancelling it ends the change.
        Raises:
            ValueError: Unknown joint or a value that is not finite.
        """
        with self.world.locked():
            return self._joints.ramp_stiffness(stiffness, duration, self.world.time)

    # --- people and parts --------------------------------------------------------------------------------------------

    def press(self, part: str, pressed: bool) -> None:
        """Press or release a touch sensor, the chest button or a bumper, as a person would.

        Raises:
            ValueError: There is no such part; the message names them.
        """
        with self.world.locked():
            self._sensors.press(part, pressed)

    def show_on_tablet(self, pixels: np.ndarray | None) -> None:
        """Show `(400, 640, 3) uint8, RGB` on the tablet; None makes it dark."""
        if self._cameras is not None:
            self._cameras.set_texture(self.prefix + "screen", _DARK if pixels is None else pixels)

    @property
    def has_cameras(self) -> bool:
        """Whether somebody draws this robot's pictures."""
        return self._cameras is not None

    def subscribe_camera(self, name: str, width: int, height: int, fps: float, kind: str = "rgb") -> Feed:
        """Subscribe to "CameraTop", "CameraBottom", "CameraDepth" or, where the head has it, "CameraStereo", whose
        pictures are those of the left and the right eye side by side; see `telepresence.sim.camera.Feed`.

        Raises:
            ValueError: Unknown camera, size or rate.
            RuntimeError: The robot was made without cameras.
        """
        if name not in self.cameras:
            raise ValueError(f"this Pepper has no camera {name!r}; cameras: {', '.join(self.cameras)}")
        if self._cameras is None:
            raise RuntimeError("this Pepper was made without cameras")
        return self._cameras.subscribe(self.cameras[name], width, height, fps, kind)

    # --- what can be read --------------------------------------------------------------------------------------------

    def has_snapshot(self) -> bool:
        """Return whether `snapshot` answers without waiting for the world: it has been asked since the last tick."""
        taken = self._snapshot
        return taken is not None and taken[0] == self.world.tick and not self._orders.waiting

    def snapshot(self) -> Snapshot:
        """Return all sensors after the last tick. Taken at the first call after a tick or a command, so both show."""
        taken = self._snapshot
        if taken is not None and self.has_snapshot():  # without waiting for a tick that may be on its way
            return taken[1]
        with self.world.locked() as data:
            self._obey()
            if self._snapshot is None or self._snapshot[0] != self.world.tick:
                self._snapshot = self.world.tick, self._readings.snapshot(data, fallen=self._fallen)
            return self._snapshot[1]

    def truth(self) -> tuple[float, float, float, float, float, float]:
        """Return where base_footprint really is: x, y, z [m], roll, pitch, yaw [rad] in the world."""
        with self.world.locked() as data:
            x, y, z, *quaternion = data.qpos[self._pose].tolist()
        return (x, y, z, *roll_pitch_yaw(*quaternion))

    def link_pose(self, name: str) -> np.ndarray:
        """Return the pose of a link or sensor frame in the odometry frame.

        Args:
            name: As in the URDF, e.g. "torso", "Head", "l_wrist", "CameraTop_frame", "base_footprint".
        Returns:
            Homogeneous matrix (4, 4); positions [m].
        Raises:
            ValueError: There is no such link; the message names them.
        """
        with self.world.locked() as data:
            return self._frames.in_odometry(data, name, self._base.odometry)

    def center_of_mass(self, names: Sequence[str]) -> tuple[float, np.ndarray]:
        """Return mass [kg] and centre of mass (3,) [m] in the odometry frame, of some links together.

        Raises:
            ValueError: One of them is no link with a mass.
        """
        with self.world.locked() as data:
            mass, center = self._frames.center_of_mass(self.world.model, data, names)
            return mass, (self._frames.in_odometry(data, ROOT, self._base.odometry) @ [*center, 1.0])[:3]

    def true_pose(self, name: str) -> np.ndarray:
        """Return the true pose of a link or sensor frame in the world, as `link_pose` does in the odometry frame.

        Returns:
            Homogeneous matrix (4, 4); positions [m].
        Raises:
            ValueError: There is no such link; the message names them.
        """
        with self.world.locked() as data:
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = self._frames.find(data, name)
        return pose

    # --- inside, lock held -------------------------------------------------------------------------------------------

    def _reset(self) -> None:
        with self.world.locked() as data:
            self._orders.clear()
            self._motion.reset()
            self.security.reset()
            self.consent.reset()
            self._joints.reset(data, STAND)
            self._base.write(data)
            self._sensors.reset()
            self._fallen = False
            self._held.clear()
            self._snapshot = None
            mujoco.mj_kinematics(self.world.model, data)
            self._inertial.reset(data)

    def _switch_reflexes_on(self) -> None:
        self.security.enabled = self.fall_manager = self.push_recovery = True

    def _close(self) -> None:
        """End all motions, so that nobody waits for a world that no longer runs."""
        with self.world.locked():
            self._motion.release()
            self._joints.stop(JOINTS)
            self._joints.set_stiffness(dict(zip(JOINTS, self._joints.stiffness.tolist(), strict=True)))

    def _tick(self, now: float) -> None:
        with self.world.locked() as data:
            self._obey()
            self._motion.tick(now, TICK)
            self._base.write(data)
            self._joints.tick(now, TICK, data)
            self._inertial.tick(data)

    def _obey(self) -> None:
        """Take the velocities that were ordered, before anything else is done with the base or seen of it."""
        while (velocity := self._orders.take()) is not None:
            self._motion.set_velocity(*velocity)
            self._check_able()
            self._snapshot = None

    def _add_obstacles(self, sensor: str, points: np.ndarray) -> None:
        self.security.update(sensor, points, self._base.odometry)
        if sensor == "Laser":
            self._readings.laser_odometry = self._base.odometry

    def _check_able(self) -> None:
        if self._fallen:
            self._motion.refuse("fallen")
        elif self._held:
            self._motion.refuse(min(self._held))
        elif self._joints.legs_limp:
            self._motion.refuse("stiffness")

    def _check_fallen(self, now: float) -> None:
        with self.world.locked() as data:
            _, x, y, _ = data.qpos[self._pose][3:]
            if not self._fallen and 1.0 - 2.0 * (x * x + y * y) < math.cos(FALLEN_TILT):
                self._fallen = True
                self._motion.refuse("fallen")
                if self.fall_manager:
                    self._joints.set_stiffness(dict.fromkeys(JOINTS, 0.0))

    def _update_power(self, now: float) -> None:
        with self.world.locked() as data:
            speed = math.hypot(self._base.vx, self._base.vy) + 0.2 * abs(self._base.wz)
            torques, stiffness = self._joints.torques(data), self._joints.stiffness
            if self.smart_stiffness:
                stiffness = self._joints.smart_stiffness(data, torques)
            self._power.update(POWER_PERIOD, torques, stiffness, speed, plugged=self._contacts.closed(data, self._pose))
