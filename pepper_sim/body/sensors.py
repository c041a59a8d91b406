"""Pepper's range sensors, bumpers and touch sensors, each read at its own rate. Called with the world's lock held."""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np

from pepper_sim.body.description import (
    INFRARED_PERIOD,
    INFRARED_RANGE,
    LASER_ANGLES,
    LASER_MAX,
    LASER_MIN,
    LASER_MISS,
    LASER_PERIOD,
    SHOVEL_ANGLES,
    SONAR_HALF_ANGLE,
    SONAR_MAX,
    SONAR_MIN,
    SONAR_PERIOD,
    SONAR_RESOLUTION,
)
from telepresence.sim.rays import RayBundle, RayRing, add_noise, cone, fan
from telepresence.sim.world import World

SONAR_NOISE = 0.01
"""Standard deviation of a sonar reading [m]; readings then fall into steps of 3 cm."""
LASER_NOISE, LASER_NOISE_PER_METRE = 0.003, 0.007
"""Standard deviation of a laser reading: 3 mm + 0.7 % of the distance, about 2.5 cm at 3 m."""
LASER_RESOLUTION = 0.001
ECHO_INCIDENCE = math.radians(65.0)
"""Greatest angle between a ray and a surface's normal at which the surface still returns an echo. The floor, hit at a
flatter angle, reflects the sound away."""

SEGMENTS = len(LASER_ANGLES)
BUMPER_PERIOD = 0.01
TOUCH_PARTS = ("FrontTactil", "MiddleTactil", "RearTactil", "HandRightBack", "HandLeftBack", "ChestButton")
BUMPER_PARTS = {"RightBumper": "FrontRight", "LeftBumper": "FrontLeft", "BackBumper": "Back"}
"""Part that a person presses -> bumper."""

_CONTACT_DISTANCE = 0.002  # a contact closer than this presses the bumper [m]
_BUMPER_SECTOR = math.radians(115.0)  # bearings beyond this belong to the back bumper

_SONARS = {"Front": "SonarFront_frame", "Back": "SonarBack_frame"}
_LASERS = {"Front": "laser_front", "Left": "laser_left", "Right": "laser_right"}
_GROUND_LASERS = {
    "Shovel": ("laser_shovel", SHOVEL_ANGLES),
    "Left": ("laser_vertical_left", (0.0,)),
    "Right": ("laser_vertical_right", (0.0,)),
}
_GROUND_FRAME = "SurroundingFrontLaser_frame"
_INFRARED = {"Left": "infrared_left", "Right": "infrared_right"}

OnObstacles = Callable[[str, np.ndarray], None]


class Sensors:
    """Newest readings of sonars, lasers, infrared spots and bumpers."""

    def __init__(self, world: World, prefix: str, on_obstacles: OnObstacles, rng: np.random.Generator) -> None:
        """`on_obstacles(sensor, points)` receives what an obstacle sensor hit, in base_footprint, shape (n, 2) [m]."""
        model = world.model
        self._model = model
        self._world = world
        self._on_obstacles = on_obstacles
        self._rng = rng
        self._base = model.body(prefix + "base_footprint").id
        self._hull = model.geom(prefix + "base_hull").id
        self._ground = model.site(prefix + _GROUND_FRAME).pos.copy()
        self._sonars = {
            name: RayBundle(model, prefix + site, cone(SONAR_HALF_ANGLE), SONAR_MAX) for name, site in _SONARS.items()
        }
        rays = fan(np.array(LASER_ANGLES))
        self._lasers = RayRing(model, [prefix + site for site in _LASERS.values()], rays, LASER_MAX)
        self._ground_lasers = {
            name: RayBundle(model, prefix + site, fan(np.array(angles)), LASER_MISS)
            for name, (site, angles) in _GROUND_LASERS.items()
        }
        straight = np.array([[1.0, 0.0, 0.0]])
        self._infrared = {
            name: RayBundle(model, prefix + site, straight, INFRARED_RANGE) for name, site in _INFRARED.items()
        }
        # All three lasers as one array of rays, seen from above: in the device's own frame and in base_footprint.
        self._laser_rows = {name: i * SEGMENTS for i, name in enumerate(_LASERS)}
        poses = [_pose_on_floor(model, prefix + site) for site in _LASERS.values()]
        self._laser_directions = np.tile(rays[:, :2], (len(_LASERS), 1))
        self._laser_directions_in_base = np.concatenate([rays[:, :2] @ rotation.T for rotation, _ in poses])
        self._laser_origins = np.repeat([origin for _, origin in poses], SEGMENTS, axis=0)
        self.sonar = dict.fromkeys(_SONARS, SONAR_MAX)
        self.laser = {name: _frozen(LASER_MISS * rays[:, :2]) for name in _LASERS}
        self.ground = {name: np.zeros((len(angles), 2)) for name, (_, angles) in _GROUND_LASERS.items()}
        self.infrared = dict.fromkeys(_INFRARED, False)
        self.bumpers = dict.fromkeys(BUMPER_PARTS.values(), False)
        self.touch = dict.fromkeys(TOUCH_PARTS, False)
        self._held: set[str] = set()
        world.every(LASER_PERIOD, self._read_lasers, phase=0.02)
        world.every(SONAR_PERIOD, self._read_sonars, phase=0.03)
        world.every(INFRARED_PERIOD, self._read_infrared, phase=0.04)
        world.every(BUMPER_PERIOD, self._read_bumpers)

    def press(self, part: str, pressed: bool) -> None:
        """Press or release a part, as a person would.

        Raises:
            ValueError: There is no such part.
        """
        if part in BUMPER_PARTS:
            (self._held.add if pressed else self._held.discard)(BUMPER_PARTS[part])
            self.bumpers[BUMPER_PARTS[part]] = pressed
        elif part in self.touch:
            self.touch[part] = bool(pressed)
        else:
            raise ValueError(f"there is no part {part!r} to press; parts: {', '.join((*TOUCH_PARTS, *BUMPER_PARTS))}")

    def reset(self) -> None:
        """Release everything that a person pressed."""
        self._held.clear()
        self.touch = dict.fromkeys(TOUCH_PARTS, False)
        self.bumpers = dict.fromkeys(self.bumpers, False)

    def _read_lasers(self, now: float) -> None:
        with self._world.locked() as data:
            true = self._lasers.cast(data).ravel()
            hit = np.isfinite(true)
            read = add_noise(
                true,
                self._rng,
                sigma=LASER_NOISE,
                proportional=LASER_NOISE_PER_METRE,
                resolution=LASER_RESOLUTION,
                minimum=LASER_MIN,
            )
            points = _frozen(np.where(hit, read, LASER_MISS)[:, None] * self._laser_directions)
            self.laser = {name: points[i : i + SEGMENTS] for name, i in self._laser_rows.items()}
            self._on_obstacles(
                "Laser", true[hit, None] * self._laser_directions_in_base[hit] + self._laser_origins[hit]
            )
            for name, bundle in self._ground_lasers.items():
                self._read_ground_laser(data, name, bundle)

    def _read_ground_laser(self, data: mujoco.MjData, name: str, bundle: RayBundle) -> None:
        distances = bundle.cast(data)
        read = np.where(np.isfinite(distances), distances, LASER_MISS)
        read = add_noise(
            read, self._rng, sigma=LASER_NOISE, proportional=LASER_NOISE_PER_METRE, resolution=LASER_RESOLUTION
        )
        rotation, origin = bundle.pose_in_body(data, self._base)
        self.ground[name] = _frozen((read[:, None] * bundle.directions @ rotation.T + origin - self._ground)[:, :2])

    def _read_sonars(self, now: float) -> None:
        with self._world.locked() as data:
            for name, bundle in self._sonars.items():
                distances = bundle.cast_echo(data, ECHO_INCIDENCE)
                nearest = int(distances.argmin())
                true = distances[nearest : nearest + 1]
                if np.isfinite(true[0]):
                    read = add_noise(true, self._rng, sigma=SONAR_NOISE, resolution=SONAR_RESOLUTION, minimum=SONAR_MIN)
                    self.sonar[name] = min(float(read[0]), SONAR_MAX)
                    rotation, origin = bundle.pose_in_body(data, self._base)
                    point = true[0] * rotation @ bundle.directions[nearest] + origin
                    self._on_obstacles("Sonar" + name, point[None, :2])
                else:
                    self.sonar[name] = SONAR_MAX
                    self._on_obstacles("Sonar" + name, np.zeros((0, 2)))

    def _read_infrared(self, now: float) -> None:
        """Read the spots. They measure no distance, so the collision protection does not use them."""
        with self._world.locked() as data:
            for name, bundle in self._infrared.items():
                self.infrared[name] = bool(np.isfinite(bundle.cast(data)[0]))

    def _read_bumpers(self, now: float) -> None:
        with self._world.locked() as data:
            pressed = set(self._held)
            touching = data.contact.geom == self._hull
            if touching.any():  # hardly ever, and the rest takes longer than this question
                touching = touching.any(axis=1) & (data.contact.dist < _CONTACT_DISTANCE)
                rotation = data.xmat[self._base].reshape(3, 3)
                local = (data.contact.pos[touching] - data.xpos[self._base]) @ rotation
                for bearing in np.arctan2(local[:, 1], local[:, 0]):
                    pressed.add(_bumper_at(float(bearing)))
            for name in self.bumpers:
                self.bumpers[name] = name in pressed


def _bumper_at(bearing: float) -> str:
    if abs(bearing) > _BUMPER_SECTOR:
        return "Back"
    return "FrontLeft" if bearing > 0.0 else "FrontRight"


def _frozen(array: np.ndarray) -> np.ndarray:
    """Make a reading read-only, because snapshots share it."""
    array.flags.writeable = False
    return array


def _pose_on_floor(model: mujoco.MjModel, site: str) -> tuple[np.ndarray, np.ndarray]:
    """Return rotation (2, 2) and origin (2,) of a site of the base, seen from above."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.site(site).quat)
    return rotation.reshape(3, 3)[:2, :2].copy(), model.site(site).pos[:2].copy()
