"""Planar base: velocity setpoint -> limited motion -> three servos, and odometry from the wheels.

The robot's root body has a free joint and stands on three frictionless feet; velocity servos at a site on the floor
under it push along x and y and turn it about z with limited force. So it is stopped by walls, pushes boxes, climbs
ramps and can tip. The model provides the free joint `root` and the actuators `drive_x`, `drive_y`, `drive_yaw`, in this
order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from telepresence.geometry import Pose, Velocity, wrap_angle

ODOMETRY_SCALE_ERROR = 0.002
"""Standard deviation of the wheels' scale error, drawn once per run for translation and for rotation. Real bases are
several times worse; this keeps a 2 m drive within millimetres of truth while odometry still isn't truth."""

HOLD_GAIN = 5.0
"""Speed per distance from the held place [1/s]."""
SLIP_DISTANCE = 0.02
"""Pushed farther than this [m], the wheels have slipped and hold the new place."""

_ACTUATORS = ("drive_x", "drive_y", "drive_yaw")


@dataclass
class BaseLimits:
    """What the base may do. All positive.

    Args:
        max_xy: Speed in any direction [m/s].
        max_theta: Turning rate [rad/s].
        acc_xy: Acceleration when speeding up [m/s²].
        acc_theta: Angular acceleration when speeding up [rad/s²].
    """

    max_xy: float
    max_theta: float
    acc_xy: float
    acc_theta: float


@dataclass(frozen=True)
class Braking:
    """Deceleration when slowing down [m/s², rad/s²]."""

    xy: float
    theta: float


class PlanarBase:
    """Moves one robot over the floor. Every method is called with the world's lock held."""

    def __init__(
        self, model: mujoco.MjModel, prefix: str, limits: BaseLimits, braking: Braking, rng: np.random.Generator
    ) -> None:
        self.limits = limits
        self.braking = braking
        self.x = self.y = self.theta = 0.0
        self.vx = self.vy = self.wz = 0.0
        first = model.actuator(prefix + _ACTUATORS[0]).id
        self._actuators = slice(first, first + 3)
        root = model.joint(prefix + "root").qposadr[0]
        self._pose = slice(root, root + 7)
        self._held: tuple[float, float] | None = None
        names = [model.actuator(i).name for i in range(model.nu)[self._actuators]]
        if names != [prefix + name for name in _ACTUATORS]:
            raise ValueError(f"{prefix}: the actuators {', '.join(_ACTUATORS)} must follow each other, found {names}")
        self._scale_xy, self._scale_theta = (1.0 + ODOMETRY_SCALE_ERROR * rng.standard_normal(2)).tolist()

    @property
    def odometry(self) -> Pose:
        """Pose by the wheels since the last reset, theta in (-pi, pi]."""
        return Pose(self.x, self.y, self.theta)

    @property
    def velocity(self) -> Velocity:
        """Velocity by the wheels in the robot's own frame."""
        return Velocity(self.vx, self.vy, self.wz)

    @property
    def standing(self) -> bool:
        return self.vx == self.vy == self.wz == 0.0

    def reset(self) -> None:
        """Stand still at the odometry's origin."""
        self.x = self.y = self.theta = 0.0
        self.vx = self.vy = self.wz = 0.0
        self._held = None

    def clamp(self, vx: float, vy: float, wz: float) -> Velocity:
        """Return the velocity with its direction kept and its size limited."""
        scale = _scale_to(math.hypot(vx, vy), self.limits.max_xy)
        return Velocity(vx * scale, vy * scale, max(-self.limits.max_theta, min(self.limits.max_theta, wz)))

    def drive(
        self, vx: float, vy: float, wz: float, dt: float, *, braking: Braking | None = None, on_course: bool = False
    ) -> None:
        """Change the velocity towards (vx, vy, wz) as far as acceleration allows in `dt`, and integrate odometry.

        Args:
            vx, vy, wz: Wanted velocity in the robot's frame [m/s, m/s, rad/s].
            dt: Length of the tick [s].
            braking: Deceleration for this tick; the base's usual one by default.
            on_course: Limit acceleration as seen from the floor, for a straight course while turning. Otherwise it is
                limited in the robot's frame, so that constant (vx, vy, wz) drives an arc.
        """
        braking = braking or self.braking
        if on_course and self.wz:
            c, s = math.cos(self.wz * dt), math.sin(self.wz * dt)
            self.vx, self.vy = self.vx * c + self.vy * s, self.vy * c - self.vx * s
        dx, dy, dw = vx - self.vx, vy - self.vy, wz - self.wz
        if dx or dy:
            slowing = dx * self.vx + dy * self.vy < 0.0
            scale = _scale_to(math.hypot(dx, dy), (braking.xy if slowing else self.limits.acc_xy) * dt)
            self.vx, self.vy = (vx, vy) if scale == 1.0 else (self.vx + scale * dx, self.vy + scale * dy)
        if dw:
            scale = _scale_to(abs(dw), (braking.theta if dw * self.wz < 0.0 else self.limits.acc_theta) * dt)
            self.wz = wz if scale == 1.0 else self.wz + scale * dw
        if self.vx or self.vy or self.wz:
            self._integrate(dt)

    def write(self, data: mujoco.MjData) -> None:
        """Hand the limited velocity to the servos; a base that stands holds its place, also on a ramp."""
        if self.standing:
            data.ctrl[self._actuators] = (*self._hold(data), 0.0)
        else:
            self._held = None
            data.ctrl[self._actuators] = (self.vx, self.vy, self.wz)

    def predict(self, dt: float) -> Pose:
        """Return the odometry pose after driving on for `dt` seconds."""
        heading = self.theta + 0.5 * self.wz * dt
        c, s = math.cos(heading), math.sin(heading)
        return Pose(
            self.x + (self.vx * c - self.vy * s) * dt,
            self.y + (self.vx * s + self.vy * c) * dt,
            wrap_angle(self.theta + self.wz * dt),
        )

    def _hold(self, data: mujoco.MjData) -> tuple[float, float]:
        """Velocity in the robot's frame back to where the wheels were stopped, as motors that hold their angle do.

        A velocity servo alone would creep down a ramp by a few mm/s.
        """
        x, y, _, w, _, _, z = data.qpos[self._pose].tolist()
        if self._held is None or math.hypot(x - self._held[0], y - self._held[1]) > SLIP_DISTANCE:
            self._held = (x, y)
        dx, dy = HOLD_GAIN * (self._held[0] - x), HOLD_GAIN * (self._held[1] - y)
        heading = 2.0 * math.atan2(z, w)
        c, s = math.cos(heading), math.sin(heading)
        return dx * c + dy * s, dy * c - dx * s

    def _integrate(self, dt: float) -> None:
        turned = self.wz * dt * self._scale_theta
        heading = self.theta + 0.5 * turned
        c, s = math.cos(heading), math.sin(heading)
        step = dt * self._scale_xy
        self.x += (self.vx * c - self.vy * s) * step
        self.y += (self.vx * s + self.vy * c) * step
        self.theta = wrap_angle(self.theta + turned)


def _scale_to(size: float, limit: float) -> float:
    """Factor that brings `size` down to `limit`; 1 if it is small enough."""
    return 1.0 if size <= limit else limit / size
