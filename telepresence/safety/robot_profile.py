"""What the gate knows about a robot: outline, limits, sensors. `ROBOTINO`, `ROBOTINO_LASER` and `PEPPER` are ready.

Figures measured on your own robot, braking and reaction above all, are set with `dataclasses.replace`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .braking import stopping_distance
from .messages import SECTORS
from .outline import Outline

UNKNOWN = -1.0
"""A range without a reading, neither near nor free; drivers fill gaps of a scan with it."""

DRIVER_COMMAND_TIMEOUT = 0.25
"""`Limits.command_timeout` of a gate on the pilot's side [s], one tick less patience than a gate's own: with a tick's
delay and the way to the wheels a robot whose pilot falls silent is at zero within 0.35 s."""

NARROW = math.radians(3.0)
"""Beams that cover no more than this to either side show shapes, and what moves [rad]."""


@dataclass(frozen=True, eq=False)
class RangeSource:
    """One device that measures distances along fixed beams, or in one wide cone.

    Args:
        name: Appears in what the pilot reads when it is silent.
        origins: (n, 2) where the beams start, in base_link [m].
        bearings: (n,) their directions in base_link [rad].
        min_range: Smaller readings of a beam are ignored; of a cone they mean "nearer than this" [m].
        max_range: Readings from here on mean "nothing there" [m].
        clear_range: How far a beam without a return is known to be free [m].
        period: Time between measurements [s].
        spread: Half the angle that a beam covers [rad]; for a cone its half angle.
        speed: Fastest driving that this source alone permits [m/s].
        near_range: The distance assumed for a cone's "nearer than min_range" [m].
        cone: A reading is an arc of `spread` to either side instead of a point.
        frozen_after: Readings that stay the same for this long while the robot moves mean that the device hangs [s].
    Attributes:
        directions: (n, 2) unit vectors along the beams.
        serves: (72, n) which sectors each beam covers.
        sectors: (72,) which sectors any beam covers.
    """

    name: str
    origins: np.ndarray
    bearings: np.ndarray
    min_range: float
    max_range: float
    clear_range: float
    period: float
    spread: float
    speed: float
    near_range: float = 0.0
    cone: bool = False
    frozen_after: float = 2.0
    directions: np.ndarray = field(init=False)
    serves: np.ndarray = field(init=False)
    sectors: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        origins, bearings = np.asarray(self.origins, float), np.asarray(self.bearings, float)
        if origins.shape != (len(bearings), 2):
            raise ValueError(f"{self.name}: {len(bearings)} beams need origins of that many x, y, not {origins.shape}")
        if not 0.0 <= self.min_range < self.clear_range <= self.max_range:
            raise ValueError(f"{self.name}: needs 0 <= min_range < clear_range <= max_range")
        away = np.abs(np.subtract.outer(np.arange(SECTORS) * math.tau / SECTORS, bearings))
        away = np.minimum(away % math.tau, -away % math.tau)
        set_field = object.__setattr__
        set_field(self, "origins", origins)
        set_field(self, "bearings", bearings)
        set_field(self, "directions", np.stack([np.cos(bearings), np.sin(bearings)], axis=1))
        set_field(self, "serves", away <= self.spread + math.pi / SECTORS)
        set_field(self, "sectors", self.serves.any(axis=1))

    @property
    def beams(self) -> int:
        return len(self.bearings)

    @property
    def same_across(self) -> float:
        """How far apart across the beam two returns of the same thing may be [m].

        More for narrow beams, which average the noise of a wall that way; a wide beam may have hit another chair leg.
        """
        return 0.04 if self.spread <= NARROW else 0.02


@dataclass(frozen=True)
class Limits:
    """Limits of the base and the room that it gets. Speeds in m/s and rad/s, distances in m, times in s.

    Args:
        max_speed, max_turn: Fastest driving and turning.
        unseen_speed: Fastest driving where no sensor points: a contact at this speed does no harm.
        escape_speed, escape_turn: Fastest motion while a bumper is latched.
        reaction: Time from knowing an obstacle until the wheels slow down: tick, transport, actuation.
        lag: Longest time until an output takes effect; the body may turn meanwhile.
        braking, braking_turn: Deceleration that can be relied on [m/s², rad/s²].
        acceleration, acceleration_turn: How fast the output may rise; the bases have their own, lower ramp.
        margin_ahead: Room left in front of the outline when driving straight at something.
        margin_beside: Room left between the outline and something at its side.
        margin_passing: Room that is enough for driving past; less than margin_beside, so that an obstacle measured a
            little too near does not stop a robot that slides along a wall.
        drift, max_drift: Odometry's error per metre driven since an obstacle was seen, and its cap [m].
        command_timeout: Without a new valid command for this long the robot stops.
        command_max_age: A command older than this by its own stamp is refused.
        sensor_timeout: A source silent for longer than this and than 2.5 of its periods is stale.
        memory: Obstacles are remembered for this long [s of driving; standing counts a fifth].
        bumper_memory: The same for obstacles that a bumper has hit.
    """

    max_speed: float
    max_turn: float
    unseen_speed: float
    reaction: float
    lag: float
    braking: float
    braking_turn: float
    escape_speed: float = 0.10
    escape_turn: float = 0.4
    acceleration: float = 1.0
    acceleration_turn: float = 1.0
    margin_ahead: float = 0.04
    margin_beside: float = 0.03
    margin_passing: float = 0.02
    drift: float = 0.02
    max_drift: float = 0.02
    command_timeout: float = 0.30
    command_max_age: float = 0.50
    sensor_timeout: float = 0.50
    memory: float = 30.0
    bumper_memory: float = 60.0


@dataclass(frozen=True)
class Swing:
    """Careful scan: turning to and fro while driving, so that beams with gaps between them see everything.

    Args:
        gap: Between two beams [rad].
        amplitude: To either side [rad]; at least half the gap.
        rate: Turning rate [rad/s].
        lead: How long the body turns on, as if at its rate, after it is told to turn back: a first guess [s].
        sweep: How long it takes from side to side: a first guess [s].
    """

    gap: float
    amplitude: float
    rate: float
    lead: float
    sweep: float


@dataclass(frozen=True)
class RobotProfile:
    """A robot as the gate knows it. `swing` is None for a robot that does not need it."""

    name: str
    outline: Outline
    limits: Limits
    sources: tuple[RangeSource, ...]
    swing: Swing | None = None

    @cached_property
    def sparse(self) -> bool:
        """Whether every beam covers a wide angle, so that none shows shapes or what moves."""
        return all(source.spread > NARROW for source in self.sources)

    @cached_property
    def farthest_room(self) -> float:
        """Obstacles with this much room limit neither driving at top speed nor turning [m]."""
        limits = self.limits
        drive = stopping_distance(limits.max_speed, limits.reaction, limits.braking)
        turn = stopping_distance(self.top_turn, limits.reaction, limits.braking_turn) * self.outline.outer_radius
        return drive + limits.margin_ahead - limits.margin_beside + turn

    @cached_property
    def top_turn(self) -> float:
        """Fastest turning, of the pilot or by the swing [rad/s]."""
        return max(self.limits.max_turn, self.swing.rate if self.swing else 0.0)

    def source(self, name: str) -> RangeSource:
        for source in self.sources:
            if source.name == name:
                return source
        raise KeyError(f"{self.name} has no range source {name!r}; there are {[s.name for s in self.sources]}")


def fan(name: str, origin: tuple[float, float], centre: float, width: float, beams: int, **rest: float) -> RangeSource:
    """Return a source of `beams` equal sectors that fill `width` [rad] around the bearing `centre`, leftmost first."""
    step = width / beams
    bearings = centre + 0.5 * width - step * (np.arange(beams) + 0.5)
    return RangeSource(name, np.tile(origin, (beams, 1)), bearings, spread=0.5 * step, cone=False, **rest)


def ring(name: str, radius: float, beams: int, **rest: float) -> RangeSource:
    """Return a source of `beams` on a circle that point outward, the first ahead, counter-clockwise."""
    bearings = math.tau * np.arange(beams) / beams
    origins = radius * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    return RangeSource(name, origins, bearings, spread=math.pi / beams, cone=False, **rest)


def sonar(name: str, origin: tuple[float, float], bearing: float, half_angle: float, **rest: float) -> RangeSource:
    return RangeSource(name, np.array([origin]), np.array([bearing]), spread=half_angle, cone=True, **rest)


INFRARED = ring(
    "infrared", 0.2264, 9, min_range=0.04, max_range=0.40, clear_range=0.30, period=0.05, speed=0.20,
    frozen_after=1.0,
)  # fmt: skip
"""Robotino's nine distance sensors, 40 degrees apart, 4 to 30 cm; 0.41 m means nothing there (vendor's api2 table).
They permit 0.20 m/s: at that speed the robot stops within 12 cm, and hitting what no beam saw releases 0.5 J."""

LASER = fan(
    "laser", (0.0, 0.0), 0.0, math.tau, 72, min_range=0.10, max_range=3.0, clear_range=3.0, period=0.05, speed=0.50,
    frozen_after=0.5,
)  # fmt: skip
"""A full circle in 5 degree sectors, the nearest return of each, leftmost first. Where a robot's laser does not point,
its beams are `UNKNOWN`: a scanner seen on a real one looks 110 degrees to either side."""

# Deceleration 0.4 m/s² and 180 deg/s² by the vendor's controld3.conf, 0.435 measured; four fifths of that are assumed.
_ROBOTINO_LIMITS = Limits(
    max_speed=0.20, max_turn=1.0, unseen_speed=0.20, reaction=0.20, lag=0.20, braking=0.35, braking_turn=2.0
)
ROBOTINO = RobotProfile(
    "Robotino",
    Outline.disc(0.2266),  # hull of the Webots model
    _ROBOTINO_LIMITS,
    (INFRARED,),
    Swing(gap=math.tau / 9, amplitude=0.384, rate=1.2, lead=0.29, sweep=1.5),
)
"""Robotino as delivered: nine infrared beams."""

_DEGREE = math.pi / 180.0
_SIDE_LASER = 1.75728
"""Bearing of Pepper's lasers at the sides [rad]."""
_PEPPER_LASER = dict(min_range=0.10, max_range=3.0, clear_range=3.0, period=0.16, speed=0.35, frozen_after=1.0)
# A cone shows that something is there, hardly that nothing is: as slow as where no sensor points.
_PEPPER_SONAR = dict(min_range=0.30, max_range=2.55, clear_range=2.55, period=0.10, speed=0.10, frozen_after=10.0)
PEPPER = RobotProfile(
    "Pepper",
    # Wheel contacts, grown until the bumpers at (0.129, ±0.227) and (-0.251, 0) are inside.
    Outline(((-0.17, 0.0), (0.09, -0.155), (0.09, 0.155)), 0.085),
    Limits(
        max_speed=0.35,
        max_turn=1.0,
        unseen_speed=0.10,
        reaction=0.30,
        lag=0.20,
        braking=0.24,
        braking_turn=0.6,
        margin_ahead=0.03,
    ),
    (
        fan("front laser", (0.0562, 0.0), 0.0, 60 * _DEGREE, 15, **_PEPPER_LASER),
        fan("left laser", (-0.018, 0.0899), _SIDE_LASER, 60 * _DEGREE, 15, **_PEPPER_LASER),
        fan("right laser", (-0.018, -0.0899), -_SIDE_LASER, 60 * _DEGREE, 15, **_PEPPER_LASER),
        # Assumed 3 cm off the outline: bars motion into the cone and no motion past it.
        sonar("front sonar", (0.0699, 0.0), 0.0, 30 * _DEGREE, near_range=0.135, **_PEPPER_SONAR),
        sonar("back sonar", (-0.0718, 0.0), math.pi, 30 * _DEGREE, near_range=0.215, **_PEPPER_SONAR),
    ),
)
"""Pepper with its own sensors; blind from 30 to 71 degrees on both sides and behind 131, but for the back sonar.
Deceleration 0.3 m/s² (ALMotion MaxAccXY default), of which four fifths are assumed."""

ROBOTINO_LASER = RobotProfile(
    "Robotino with laser",
    ROBOTINO.outline,
    replace(_ROBOTINO_LIMITS, max_speed=0.50, unseen_speed=0.10),
    (LASER, INFRARED),
)
"""Robotino with a laser; falls back to the infrared sensors' speed when the laser is silent, and where it does not
point."""
