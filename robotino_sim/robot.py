"""Robotino in the simulated world: setpoints in, snapshots out. SI units, no REST words.

Conventions: x forward, y left, z up, counter-clockwise positive (REP 103). Methods may be called from any thread.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import partial

import mujoco

from robotino_sim import infrared, laser
from robotino_sim.controller import CYCLE, ODOMETRY_PERIOD, REST_WATCHDOG, DriveController, Odometry
from robotino_sim.inputs_outputs import InputsOutputs
from robotino_sim.kinematics import Triple
from robotino_sim.localization import Localization, PoseEstimate
from robotino_sim.models import PREFIX
from robotino_sim.power import Battery, PowerState
from telepresence.geometry import require_finite, roll_pitch_yaw
from telepresence.sim.camera import Cameras, Feed
from telepresence.sim.world import TICK, World

POWER_PERIOD = 1.0
_TOUCH = 0.0005
"""A contact this close presses the bumper strip [m]."""


@dataclass(frozen=True)
class Snapshot:
    """Readings of Robotino's controller at one instant.

    Args:
        time: Simulation time [s]; it never runs backwards.
        stamp: Wall-clock time [s since 1970].
        odometry: The last reading, at most 50 ms old.
        distances: Of the nine infrared sensors, 0 ahead, counter-clockwise [m]; 0.41 is "nothing".
        bumper: Whether the strip around the robot is pressed anywhere.
        motors: Speeds of the motors 1, 2, 3 [rpm].
        scan: The last one of the laser scanner; None without a scanner.
        power: Battery and charging.
        localization: Where the robot believes to be in the room, at most 50 ms old.
    """

    time: float
    stamp: float
    odometry: Odometry
    distances: tuple[float, ...]
    bumper: bool
    motors: Triple
    scan: laser.Scan | None
    power: PowerState
    localization: PoseEstimate


class Robotino:
    """One Robotino of a world. It starts standing at the origin of its odometry.

    `inputs_outputs` are the connectors on its back.
    """

    def __init__(
        self,
        world: World,
        cameras: Cameras | None,
        prefix: str = PREFIX,
        seed: int = 0,
        *,
        watchdog: float = REST_WATCHDOG,
        battery: str = "NiMH",
        charging: bool = False,
        noise: bool = True,
    ) -> None:
        """
        Args:
            world: Built with `robotino_sim.models.robotino_model(prefix)` among its robots.
            cameras: Draws this world's cameras; without it the robot is blind.
            prefix: Prefix of this robot's names in the world.
            seed: Start of the sensors' noise, together with the world's seed.
            watchdog: Silence after which the motors stop [s].
            battery: "NiMH" or "Pb" (Robotino 3), "Li-Ion" (Robotino 4).
            charging: It stands at the charger from the start, its mains cable connected.
            noise: False makes sensors and wheels perfect but for their resolution.
        Raises:
            ValueError: Unknown battery, or a watchdog that is not positive.
        """
        if not watchdog > 0.0:
            raise ValueError(f"the watchdog's time must be positive, got {watchdog}")
        model = world.model
        self.world = world
        self.prefix = prefix
        self.inputs_outputs = InputsOutputs()
        self._cameras = cameras
        rng = world.rng(f"{prefix}{seed}") if noise else None
        self._drive = DriveController(watchdog, world.rng(prefix + "wheels") if noise else None)
        self._battery = Battery(battery, external=charging)
        self._localization = Localization(world.rng(prefix + "localization") if noise else None)
        root = model.joint(prefix + "root").qposadr[0]
        self._pose = slice(root, root + 7)
        first = model.actuator(prefix + "drive_x").id
        self._actuators = slice(first, first + 3)
        self._bumper = model.geom(prefix + "bumper").id
        self._infrared = infrared.InfraredRing(model, prefix, rng)
        carries_laser = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, prefix + "laser_scanner") >= 0
        self._laser = laser.LaserScanner(model, prefix, rng) if carries_laser else None
        self._held_bumper = False
        self._reset()
        world.on_reset(self._reset)
        world.every(TICK, self._tick)
        world.every(ODOMETRY_PERIOD, self._publish_odometry)
        world.every(infrared.PERIOD, self._measure)
        world.every(POWER_PERIOD, lambda _: self._battery.elapse(POWER_PERIOD))
        if self._laser is not None:
            world.every(laser.PERIOD, partial(self._scan_surroundings, self._laser), phase=0.015)
        world.reset()

    # --- commands --------------------------------------------------------------------------------------------

    def set_velocity(self, vx: float, vy: float, wz: float) -> None:
        """Drive at this velocity, within the robot's limits, until the watchdog expires.

        Args:
            vx, vy: Forward and left in base_link [m/s].
            wz: Counter-clockwise [rad/s].
        Raises:
            ValueError: A value is not finite.
        """
        require_finite("velocity", (vx, vy, wz))
        with self.world.locked():
            self._last_command = time.monotonic()
            self._drive.set_velocity(vx, vy, wz, self.world.time)

    def set_odometry(self, x: float, y: float, phi: float) -> None:
        """Set odometry's pose [m, m, rad]; the robot stays where it is."""
        with self.world.locked():
            self._drive.set_odometry(x, y, phi)
            self._odometry = self._drive.odometry

    def press_bumper(self, pressed: bool) -> None:
        """Press or release the bumper strip."""
        with self.world.locked():
            self._held_bumper = pressed

    def subscribe_camera(self, width: int, height: int, fps: float) -> Feed:
        """Start pictures of the webcam; see `telepresence.sim.camera.Feed`.

        Raises:
            ValueError: Impossible size or rate.
            RuntimeError: The robot was made without cameras.
        """
        if self._cameras is None:
            raise RuntimeError("this Robotino was made without cameras")
        return self._cameras.subscribe(self.prefix + "camera", width, height, fps)

    # --- readings --------------------------------------------------------------------------------------------

    @property
    def watchdog(self) -> float:
        """Silence after which the motors stop [s]."""
        return self._drive.watchdog

    def snapshot(self) -> Snapshot:
        """Return the newest readings, each at most one period old."""
        with self.world.locked():
            return Snapshot(
                time=self.world.time,
                stamp=self.world.stamp,
                odometry=self._odometry,
                distances=self._distances,
                bumper=self._pressed or self._held_bumper,
                motors=self._drive.motors,
                scan=self._scan,
                power=self._battery.state,
                localization=self._localization.estimate,
            )

    def truth(self) -> tuple[float, float, float, float, float, float]:
        """Return the true pose of base_link: x, y, z [m], roll, pitch, yaw [rad] in the world."""
        with self.world.locked() as data:
            x, y, z, *quaternion = data.qpos[self._pose].tolist()
        return x, y, z, *roll_pitch_yaw(*quaternion)

    # --- inside, lock held -------------------------------------------------------------------------------------------

    def _reset(self) -> None:
        self._drive.reset()
        self._battery.reset()
        self._localization.reset()
        self.inputs_outputs.reset()
        self._odometry = Odometry()
        self._distances = (infrared.NOTHING,) * infrared.COUNT
        self._pressed = self._held_bumper = False
        self._scan: laser.Scan | None = None
        self._cycle_due = 0.0
        self._last_command = -math.inf
        with self.world.locked() as data:
            data.ctrl[self._actuators] = 0.0

    def _tick(self, now: float) -> None:
        if now >= self._cycle_due - 0.5 * TICK:
            self._cycle_due = now + CYCLE
            # A world that makes up for a stall runs ahead of the clock by which clients send.
            if self.world.running and time.monotonic() - self._last_command <= self._drive.watchdog:
                self._drive.keep_alive(now)
            self._drive.cycle(now)
        with self.world.locked() as data:
            data.ctrl[self._actuators] = self._drive.turn_motors(TICK)
            self._pressed = self._is_touched(data)

    def _is_touched(self, data: mujoco.MjData) -> bool:
        count = data.ncon
        if not count:
            return False
        contact = data.contact
        return bool(((contact.geom[:count] == self._bumper).any(axis=1) & (contact.dist[:count] < _TOUCH)).any())

    def _publish_odometry(self, now: float) -> None:
        self._odometry = self._drive.publish_odometry()
        x, y, _, _, _, yaw = self.truth()
        self._localization.update(x, y, yaw)

    def _measure(self, now: float) -> None:
        with self.world.locked() as data:
            _, distances = self._infrared.measure(data)
        self._distances = tuple(distances.tolist())

    def _scan_surroundings(self, scanner: laser.LaserScanner, now: float) -> None:
        with self.world.locked() as data:
            self._scan = scanner.measure(data, self.world.stamp)
