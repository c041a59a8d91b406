"""The walker in the simulated world: velocities in, snapshots out. SI units.

Conventions: x forward, y left, z up, counter-clockwise positive (REP 103). Methods may be called from any thread.
"""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass

import mujoco
import numpy as np

from telepresence.geometry import require_finite, roll_pitch_yaw, wrap_angle
from telepresence.sim.camera import Cameras, Feed
from telepresence.sim.walker.body import PREFIX, joint_names, standing_angles
from telepresence.sim.walker.gait import GAITS, TROT, GaitController
from telepresence.sim.walker.kinematics import FOOT_RADIUS, LEGS, feet_at, joint_angles
from telepresence.sim.world import World

log = logging.getLogger(__name__)

CYCLE = 0.01
"""Period of sensing and control [s]."""
WATCHDOG = 0.5
"""Silence after which the robot freezes [s]."""
FALLEN_TILT = math.radians(45.0)
"""A trunk tilted further than this has fallen; the robot then goes limp until the world is reset."""
HEADING_GAIN = 2.0
"""Turning rate per error of heading while walking straight [1/s]."""
TILT_NOISE = math.radians(0.15)
"""Standard deviation of roll and pitch by the inertial sensor [rad]."""
TILT_BIAS, GYRO_DRIFT = math.radians(0.3), math.radians(0.02)
"""Standard deviations of errors that stay for a run: of roll and pitch [rad], of the heading's drift [rad/s]."""
JOINT_ZERO_ERROR = 0.008
"""Standard deviation of where a joint takes zero to be, drawn once per run [rad]."""


@dataclass(frozen=True)
class Snapshot:
    """Readings of the robot's own sensors at one instant.

    Args:
        time: Simulation time [s]; it never runs backwards.
        stamp: Wall-clock time [s since 1970].
        odometry: By legs and inertial sensor since the last reset: x, y, theta [m, m, rad].
        velocity: By the same: vx, vy, wz in the trunk's frame [m/s, m/s, rad/s].
        attitude: Roll, pitch, yaw by the inertial sensor [rad].
        joints: `out`, `hip`, `knee` of each leg [rad]: 12 angles in the order of `kinematics.LEGS`.
        torques: Of the same joints [N m].
        feet: Whether each foot carries weight.
        gait: Name of the gait.
        phase: Of the gait, 0 to 1.
        walking: False when frozen.
        fallen: The robot lies on its side or back.
    """

    time: float
    stamp: float
    odometry: tuple[float, float, float]
    velocity: tuple[float, float, float]
    attitude: tuple[float, float, float]
    joints: tuple[float, ...]
    torques: tuple[float, ...]
    feet: tuple[bool, ...]
    gait: str
    phase: float
    walking: bool
    fallen: bool


class Walker:
    """One walker of a world. It starts standing at the origin of its odometry.

    Attributes:
        hold_heading: While walking without turning, steer back to the heading at which that began.
    """

    def __init__(
        self,
        world: World,
        cameras: Cameras | None,
        prefix: str = PREFIX,
        seed: int = 0,
        *,
        gait: str = TROT.name,
        watchdog: float = WATCHDOG,
        hold_heading: bool = True,
    ) -> None:
        """
        Args:
            world: Built with `telepresence.sim.walker.body.walker_model(prefix)` among its robots.
            cameras: Draws this world's cameras; without it the robot is blind.
            prefix: Prefix of this robot's names in the world.
            seed: Start of the errors of sensors and joints, together with the world's seed.
            gait: Name of the gait, see `choose_gait`.
            watchdog: Silence after which the robot freezes [s].
            hold_heading: See above.
        Raises:
            ValueError: Unknown gait, or a watchdog that is not positive.
        """
        if not watchdog > 0.0:
            raise ValueError(f"the watchdog's time must be positive, got {watchdog}")
        model = world.model
        self.world = world
        self.prefix = prefix
        self.hold_heading = hold_heading
        self._cameras = cameras
        self._watchdog = watchdog
        self._rng = world.rng(f"{prefix}{seed}")
        self._zero_error = JOINT_ZERO_ERROR * self._rng.standard_normal(12)
        self._tilt_bias = TILT_BIAS * self._rng.standard_normal(2)
        self._drift = GYRO_DRIFT * float(self._rng.standard_normal())
        names = joint_names(prefix)
        self._qpos = np.array([model.joint(name).qposadr[0] for name in names])
        self._dofs = np.array([model.joint(name).dofadr[0] for name in names])
        self._servos = np.array([model.actuator(name).id for name in names])
        root = model.joint(prefix + "root")
        self._pose = slice(root.qposadr[0], root.qposadr[0] + 7)
        self._feet = np.array([model.geom(f"{prefix}{leg}_foot").id for leg in LEGS])
        self._standing = standing_angles().ravel()
        self._stiffness = model.actuator_gainprm[self._servos, 0].copy()
        self._gait = GaitController()
        self.choose_gait(gait)
        world.on_reset(self._reset)
        world.every(CYCLE, self._cycle)
        world.reset()

    # --- commands --------------------------------------------------------------------------------------------

    def set_velocity(self, vx: float, vy: float, wz: float) -> None:
        """Walk at this velocity, within the gait's limits, until the watchdog expires; zeros freeze the gait at once.

        Args:
            vx, vy: Forward and left in the trunk's frame [m/s].
            wz: Counter-clockwise [rad/s].
        Raises:
            ValueError: A value is not finite.
        """
        require_finite("velocity", (vx, vy, wz))
        with self.world.locked():
            self._last_command = time.monotonic()
            self._deadline = self.world.time + self._watchdog
            self._wanted = np.array([vx, vy, wz])

    def move(self, direction: int) -> None:
        """Walk at the gait's own speed until the next call, without a watchdog: the topic `movement_command`.

        Args:
            direction: 1 forward, -1 backward, 0 freezes the gait.
        """
        if direction not in (-1, 0, 1):
            raise ValueError(f"a direction is 1, -1 or 0, got {direction}")
        with self.world.locked():
            gait = self._gait.gait if self._gait.walking else self._gait.next
            self._wanted = np.array([direction * gait.cruise, 0.0, 0.0])
            self._deadline = math.inf

    def choose_gait(self, name: str) -> None:
        """Use this gait from the next start on; a standing robot changes at once.

        Raises:
            ValueError: There is no such gait; the message names those that exist.
        """
        if name not in GAITS:
            raise ValueError(f"there is no gait {name!r}; gaits: {', '.join(GAITS)}")
        with self.world.locked():
            self._gait.choose(GAITS[name])

    def subscribe_camera(self, width: int, height: int, fps: float) -> Feed:
        """Start pictures of the camera in its head; see `telepresence.sim.camera.Feed`.

        Raises:
            ValueError: Impossible size or rate.
            RuntimeError: The robot was made without cameras.
        """
        if self._cameras is None:
            raise RuntimeError("this walker was made without cameras")
        return self._cameras.subscribe(self.prefix + "camera", width, height, fps)

    # --- readings --------------------------------------------------------------------------------------------

    def snapshot(self) -> Snapshot:
        """Return the readings of the last control cycle."""
        with self.world.locked() as data:
            return Snapshot(
                time=self.world.time,
                stamp=self.world.stamp,
                odometry=self._odometry,
                velocity=self._velocity,
                attitude=(*self._tilt, self._yaw),
                joints=tuple((data.qpos[self._qpos] - self._zero_error).tolist()),
                torques=tuple(data.qfrc_actuator[self._dofs].tolist()),
                feet=tuple(self._contacts(data).tolist()),
                gait=self._gait.gait.name,
                phase=self._gait.phase,
                walking=self._gait.walking,
                fallen=self._fallen,
            )

    def truth(self) -> tuple[float, float, float, float, float, float]:
        """Return the true pose of the trunk: x, y, z [m], roll, pitch, yaw [rad] in the world."""
        with self.world.locked() as data:
            pose = data.qpos[self._pose].tolist()
        return (*pose[:3], *roll_pitch_yaw(*pose[3:]))

    # --- inside, lock held -------------------------------------------------------------------------------------------

    def _reset(self) -> None:
        with self.world.locked() as data:
            data.qpos[self._qpos] = self._standing + self._zero_error
            data.ctrl[self._servos] = self._standing + self._zero_error
            self._set_strength(1.0)
            self._start_yaw = roll_pitch_yaw(*data.qpos[self._pose][3:].tolist()).yaw
        self._gait.reset()
        self._wanted = np.zeros(3)
        self._deadline = self._last_command = -math.inf
        self._fallen = False
        self._odometry = self._velocity = (0.0, 0.0, 0.0)
        self._tilt = (0.0, 0.0)
        self._yaw = 0.0
        self._since_reset = 0.0
        self._heading: float | None = None
        self._last_places: np.ndarray | None = None

    def _cycle(self, now: float) -> None:
        with self.world.locked() as data:
            self._sense(data)
            if self._fallen:
                return
            if 1.0 - math.cos(self._tilt[0]) * math.cos(self._tilt[1]) > 1.0 - math.cos(FALLEN_TILT):
                self._fall(data)
                return
            feet = self._gait.step(self._command(now), CYCLE, self._tilt)
            data.ctrl[self._servos] = joint_angles(feet).ravel() + self._zero_error

    def _command(self, now: float) -> np.ndarray:
        """Return the velocity to walk with now; zeros when no command has come lately."""
        # A world that makes up for a stall runs ahead of the clock by which clients send.
        silent = now > self._deadline and not (
            self.world.running and time.monotonic() - self._last_command <= self._watchdog
        )
        if silent or not self._wanted.any():
            self._heading = None
            return np.zeros(3)
        wanted = self._wanted.copy()
        if not self.hold_heading or wanted[2]:
            self._heading = None
            return wanted
        if self._heading is None:
            self._heading = self._yaw
        wanted[2] = HEADING_GAIN * wrap_angle(self._heading - self._yaw)
        return wanted

    def _sense(self, data: mujoco.MjData) -> None:
        """Inertial sensor and leg odometry."""
        roll, pitch, yaw = roll_pitch_yaw(*data.qpos[self._pose][3:].tolist())
        noise = self._rng.standard_normal(2)
        self._since_reset += CYCLE
        self._tilt = (
            roll + float(self._tilt_bias[0] + TILT_NOISE * noise[0]),
            pitch + float(self._tilt_bias[1] + TILT_NOISE * noise[1]),
        )
        last_yaw, self._yaw = self._yaw, wrap_angle(yaw - self._start_yaw + self._drift * self._since_reset)
        angles = (data.qpos[self._qpos] - self._zero_error).reshape(4, 3)
        feet = feet_at(angles)
        # A round foot rolls while the leg swings over it.
        x = feet[:, 0] - FOOT_RADIUS * (angles[:, 1] + angles[:, 2])
        y = feet[:, 1] + FOOT_RADIUS * angles[:, 0]
        places = np.stack([x, y], axis=1)
        moved = np.zeros((4, 2)) if self._last_places is None else places - self._last_places
        self._last_places = places
        # A foot's own sensor, because it meets the ground later than the gait wants it to.
        down = self._contacts(data)
        turned = wrap_angle(self._yaw - last_yaw)
        dx = dy = 0.0
        if down.any():
            x, y = feet[down, 0], feet[down, 1]
            dx = float(np.mean(-moved[down, 0] + turned * y))
            dy = float(np.mean(-moved[down, 1] - turned * x))
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        ox, oy, _ = self._odometry
        self._odometry = (ox + c * dx - s * dy, oy + s * dx + c * dy, self._yaw)
        if self._gait.walking and not down.any():  # a trot leaves the ground for a moment, and goes on meanwhile
            return
        vx, vy, wz = self._velocity
        blend = 0.1  # of a new reading: a step's jerks are no motion of the robot
        self._velocity = (
            vx + blend * (dx / CYCLE - vx),
            vy + blend * (dy / CYCLE - vy),
            wz + blend * (turned / CYCLE - wz),
        )

    def _fall(self, data: mujoco.MjData) -> None:
        log.warning("%s has fallen and lies limp until the world is restarted", self.prefix.rstrip("/"))
        self._fallen = True
        self._gait.freeze()
        self._set_strength(0.05)

    def _set_strength(self, share: float) -> None:
        model = self.world.model
        model.actuator_gainprm[self._servos, 0] = share * self._stiffness
        model.actuator_biasprm[self._servos, 1] = -share * self._stiffness

    def _contacts(self, data: mujoco.MjData) -> np.ndarray:
        """Return which feet touch something, shape (4,) bool."""
        return (data.contact.geom[: data.ncon].reshape(-1, 1) == self._feet).any(axis=0)
