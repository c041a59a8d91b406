"""The robots of the safety benchmark: true body, drive and range sensors, less kind than the gate's model."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from safety.geometry import Hull, cast
from safety.worlds import Batch

from telepresence.safety import PEPPER, ROBOTINO, ROBOTINO_LASER, RangeSource, RobotProfile

TICK = 0.05
"""Period of gate and sensors [s]."""
SIGMA = 0.01
"""Standard deviation of a range [m]."""
BEAM_HALF_WIDTH = 0.01
"""An infrared beam is this wide to either side [m]."""
FOLD_BACK = ((0.0, 0.004, 0.01, 0.02, 0.024, 0.03, 0.04), (0.10, 0.093, 0.068, 0.055, 0.050, 0.040, 0.040))
"""True distance and what a Sharp sensor reads below 4 cm [m]: the voltage falls again (Webots and api2 tables)."""
NOTHING = 0.41
"""Robotino's infrared sensors read this when nothing is there [m]."""


@dataclass(frozen=True)
class BenchRobot:
    """What is simulated.

    Args:
        name: For the report.
        profile: What the gate believes.
        acceleration, braking: Of the base, varied by 10 % from place to place [m/s²].
        turn_acceleration, turn_braking: [rad/s²].
        delay: Range of the time from the gate's output to the base's reacting [s].
        latency: From measuring to the gate, by source [ticks].
        every: Measurements, by source [ticks].
        bumpers: Bearings of the bumpers that report where they were hit [rad]; None for one ring that doesn't.
    """

    name: str
    profile: RobotProfile
    acceleration: float
    braking: float
    turn_acceleration: float
    turn_braking: float
    delay: tuple[float, float]
    latency: dict[str, int]
    every: dict[str, int]
    bumpers: tuple[float, ...] | None = None

    @property
    def hull(self) -> Hull:
        return Hull(np.array(self.profile.outline.vertices), self.profile.outline.radius)


_ROBOTINO = dict(acceleration=0.4, braking=0.4, turn_acceleration=3.14, turn_braking=3.14, delay=(0.05, 0.15))
INFRARED_ROBOT = BenchRobot("Robotino, infrared", ROBOTINO, latency={"infrared": 1}, every={"infrared": 1}, **_ROBOTINO)
MEASURED_ROBOT = BenchRobot(
    "Robotino, infrared, as measured over Wi-Fi",
    ROBOTINO,
    acceleration=0.268,
    braking=0.435,
    turn_acceleration=0.919,
    turn_braking=2.67,
    delay=(0.15, 0.25),
    latency={"infrared": 1},
    every={"infrared": 1},
)
"""A real one over Wi-Fi, by the motion parameters that a lab publishes (hsbi-robotino-navigation, motion.yaml); 0.216 s
from a command to its effect."""
LASER_ROBOT = BenchRobot(
    "Robotino, laser",
    ROBOTINO_LASER,
    latency={"laser": 1, "infrared": 1},
    every={"laser": 1, "infrared": 1},
    **_ROBOTINO,
)
_PEPPER_SOURCES = [source.name for source in PEPPER.sources]
PEPPER_ROBOT = BenchRobot(
    "Pepper",
    PEPPER,
    acceleration=0.3,
    braking=0.3,
    turn_acceleration=0.75,
    turn_braking=0.75,
    delay=(0.05, 0.15),
    latency=dict.fromkeys(_PEPPER_SOURCES, 2),
    every={name: 2 if "sonar" in name else 3 for name in _PEPPER_SOURCES},
    bumpers=(1.054, -1.054, math.pi),
)


def measure(source: RangeSource, batch: Batch, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One measurement of a source in every place, shape (S, beams) [m]. Draws as many random values every time.

    Args:
        pose: (S, 3).
    """
    if source.cone:
        return _sonar(source, batch, pose, rng)
    if source.name == "infrared":
        return _infrared(source, batch, pose, rng)
    origins, directions = _placed(source.origins, source.directions, pose)
    distance = cast(batch, origins, directions, source.max_range)
    noise = SIGMA * rng.standard_normal(distance.shape)
    return np.where(np.isfinite(distance), np.maximum(distance + noise, 0.0), source.max_range)


def _infrared(source: RangeSource, batch: Batch, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Three parallel rays per beam; noise that doubles beyond 30 cm; too near reads farther."""
    across = np.stack([-source.directions[:, 1], source.directions[:, 0]], axis=1) * BEAM_HALF_WIDTH
    origins = np.concatenate([source.origins - across, source.origins, source.origins + across])
    origins, directions = _placed(origins, np.tile(source.directions, (3, 1)), pose)
    distance = cast(batch, origins, directions, batch.infrared_reach).reshape(len(pose), 3, source.beams).min(1)
    noise = rng.standard_normal(distance.shape)
    finite = np.where(np.isfinite(distance), distance, NOTHING)
    read = finite + noise * SIGMA * (1.0 + np.clip((finite - 0.30) / 0.10, 0.0, 1.0))
    read = np.where(finite < 0.04, np.interp(finite, *FOLD_BACK), np.maximum(read, 0.04))
    return np.where(np.isfinite(distance) & (read < source.max_range), read, NOTHING)


def _sonar(source: RangeSource, batch: Batch, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The nearest thing in the cone; steps of 3 cm; at least the least range (facts of Pepper's sonar)."""
    bearings = source.bearings[0] + np.linspace(-source.spread, source.spread, 13)
    rays = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    origins, directions = _placed(np.tile(source.origins, (13, 1)), rays, pose)
    distance = cast(batch, origins, directions, source.max_range).min(1, keepdims=True)
    noise = SIGMA * rng.standard_normal(distance.shape)
    finite = np.where(np.isfinite(distance), distance + noise, source.max_range)
    return np.where(
        np.isfinite(distance), np.maximum(np.round(finite / 0.03) * 0.03, source.min_range), source.max_range
    )


def _placed(origins: np.ndarray, directions: np.ndarray, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    rotation = np.stack([np.stack([c, s], 1), np.stack([-s, c], 1)], 1)
    return origins @ rotation + pose[:, None, :2], directions @ rotation
