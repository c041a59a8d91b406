"""Pepper's range sensors, bumpers and touch sensors, each read at its own rate. Called with the world's lock held."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

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
from telepresence.sim.rays import Rays, add_noise, cone, fan
from telepresence.sim.stillness import Stillness
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


@dataclass(frozen=True)
class _Hits:
    """What rays have met.

    Args:
        distances: True distances (n,) [m]; infinity for nothing.
        points: In base_footprint, shape (m, 2) [m].
    """

    distances: np.ndarray
    points: np.ndarray

    @classmethod
    def of(cls, rays: Rays, distances: np.ndarray) -> _Hits:
        """Return what rays of the base have met at these distances (n,) [m]."""
        hit = np.flatnonzero(np.isfinite(distances))
        return cls(distances, distances[hit, None] * rays.directions[hit, :2] + rays.origins[hit, :2])


@dataclass(frozen=True)
class _Echo:
    """The nearest of what sends an echo to a sonar.

    Args:
        distance: [m]; infinity for nothing.
        points: In base_footprint, shape (1, 2) [m]; (0, 2) for nothing.
    """

    distance: float
    points: np.ndarray


class Sensors:
    """Newest readings of sonars, lasers, infrared spots and bumpers."""

    def __init__(self, world: World, prefix: str, on_obstacles: OnObstacles, rng: np.random.Generator) -> None:
        """`on_obstacles(sensor, points)` receives what an obstacle sensor hit, in base_footprint, shape (n, 2) [m]."""
        model = world.model
        self._world = world
        self._on_obstacles = on_obstacles
        self._rng = rng
        self._base = model.body(prefix + "base_footprint").id
        self._hull = model.geom(prefix + "base_hull").id
        self._hull_touched = int(model.sensor(prefix + "hull_touched").adr[0])
        self._ground = model.site(prefix + _GROUND_FRAME).pos[:2].copy()
        ahead, straight = fan(np.array(LASER_ANGLES)), np.array([[1.0, 0.0, 0.0]])
        ground = [(prefix + site, fan(np.array(angles))) for site, angles in _GROUND_LASERS.values()]
        self._sonars = Rays(model, [(prefix + site, cone(SONAR_HALF_ANGLE)) for site in _SONARS.values()], SONAR_MAX)
        self._lasers = Rays(model, [(prefix + site, ahead) for site in _LASERS.values()], LASER_MAX, all_around=True)
        self._ground_lasers = Rays(model, ground, LASER_MISS)
        self._infrared = Rays(model, [(prefix + site, straight) for site in _INFRARED.values()], INFRARED_RANGE)
        self._laser_rows = {name: slice(i * SEGMENTS, (i + 1) * SEGMENTS) for i, name in enumerate(_LASERS)}
        self._laser_directions = np.tile(ahead[:, :2], (len(_LASERS), 1))
        self._ground_ends = np.cumsum([len(directions) for _, directions in ground])[:-1]
        # What was measured last, until something moves.
        self._sonars_rest = Stillness(self._sonars.body, self._sonars.others)
        self._lasers_rest = Stillness(self._lasers.body, self._lasers.others)
        self._infrared_rest = Stillness(self._infrared.body, self._infrared.others)
        self._echoes: dict[str, _Echo] = {}
        self._laser_hits = _Hits(np.empty(0), np.empty((0, 2)))
        self._ground_distances = np.empty(0)
        self.sonar = dict.fromkeys(_SONARS, SONAR_MAX)
        self.laser = {name: _frozen(LASER_MISS * ahead[:, :2]) for name in _LASERS}
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
            if not self._lasers_rest.holds(data):
                self._laser_hits = _Hits.of(self._lasers, self._lasers.cast(data))
                self._ground_distances = self._ground_lasers.cast(data)
            self._on_obstacles("Laser", self._laser_hits.points)
        true = self._laser_hits.distances
        read = np.where(np.isfinite(true), self._noisy(true, LASER_MIN), LASER_MISS)
        points = _frozen(read[:, None] * self._laser_directions)
        self.laser = {name: points[rows] for name, rows in self._laser_rows.items()}
        read = self._noisy(np.minimum(self._ground_distances, LASER_MISS))
        rays = self._ground_lasers
        points = _frozen(read[:, None] * rays.directions[:, :2] + rays.origins[:, :2] - self._ground)
        self.ground = dict(zip(_GROUND_LASERS, np.split(points, self._ground_ends), strict=True))

    def _noisy(self, distances: np.ndarray, minimum: float = 0.0) -> np.ndarray:
        """Return what lasers read instead of the true distances."""
        return add_noise(
            distances,
            self._rng,
            sigma=LASER_NOISE,
            proportional=LASER_NOISE_PER_METRE,
            resolution=LASER_RESOLUTION,
            minimum=minimum,
        )

    def _read_sonars(self, now: float) -> None:
        with self._world.locked() as data:
            if not self._sonars_rest.holds(data):
                self._echoes = self._first_echoes(self._sonars.cast_echo(data, ECHO_INCIDENCE))
            for name, echo in self._echoes.items():
                self.sonar[name] = self._sonar_reading(echo.distance)
                self._on_obstacles("Sonar" + name, echo.points)

    def _first_echoes(self, distances: np.ndarray) -> dict[str, _Echo]:
        echoes, rays = {}, self._sonars
        count = len(distances) // len(_SONARS)
        for name, first in zip(_SONARS, range(0, len(distances), count), strict=True):
            nearest = first + int(distances[first : first + count].argmin())
            distance = float(distances[nearest])
            heard = slice(nearest, nearest + math.isfinite(distance))
            echoes[name] = _Echo(distance, distance * rays.directions[heard, :2] + rays.origins[heard, :2])
        return echoes

    def _sonar_reading(self, nearest: float) -> float:
        if math.isinf(nearest):
            return SONAR_MAX
        steps = round((nearest + SONAR_NOISE * self._rng.standard_normal()) / SONAR_RESOLUTION)
        return min(max(steps * SONAR_RESOLUTION, SONAR_MIN), SONAR_MAX)

    def _read_infrared(self, now: float) -> None:
        """Read the spots. They measure no distance, so the collision protection does not use them."""
        with self._world.locked() as data:
            if not self._infrared_rest.holds(data):
                seen = np.isfinite(self._infrared.cast(data)).tolist()
                self.infrared.update(zip(_INFRARED, seen, strict=True))

    def _read_bumpers(self, now: float) -> None:
        with self._world.locked() as data:
            pressed = set(self._held)
            if data.sensordata[self._hull_touched]:  # hardly ever, and the rest takes longer than this question
                contacts = data.contact
                touching = (contacts.geom == self._hull).any(axis=1) & (contacts.dist < _CONTACT_DISTANCE)
                rotation = data.xmat[self._base].reshape(3, 3)
                local = (contacts.pos[touching] - data.xpos[self._base]) @ rotation
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
