"""What a robot publishes, as plain data: `gui.ros.topics` converts messages to these, widgets paint them.

Positions are in the robot's base frame on the floor under it (x forward, y left, z up) or in `odom`; SI units;
`arrived` is when the message arrived here [monotonic s]. No ROS, no Qt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

SECTORS = 72
"""Directions of `Safety.allowed`; sector k is centred k * 5 degrees counter-clockwise from x."""


@dataclass(frozen=True)
class Points:
    """What a scanner sees; `at` holds (n, 2) float [m], base frame."""

    source: str
    at: np.ndarray
    arrived: float


@dataclass(frozen=True)
class Beams:
    """Narrow beams around the body, like Robotino's infrared ring.

    Args:
        starts: (n, 2) float [m], base frame.
        bearings: (n,) float [rad], base frame.
        ranges: (n,) float [m] from the start; infinity where nothing is, NaN where nothing was measured.
        reach: How far a beam sees [m].
    """

    source: str
    starts: np.ndarray
    bearings: np.ndarray
    ranges: np.ndarray
    reach: float
    arrived: float


@dataclass(frozen=True)
class Cone:
    """A sonar at (x, y) [m] that points to `bearing` [rad] and is `width` [rad] wide; range as in `Beams` [m]."""

    source: str
    x: float
    y: float
    bearing: float
    width: float
    range: float
    reach: float
    arrived: float


@dataclass(frozen=True)
class Bumpers:
    """The names of the pressed bumpers: left, right, back, or ring for one all around."""

    pressed: frozenset[str]
    arrived: float


@dataclass(frozen=True)
class Safety:
    """One decision of the safety gate (telepresence_msgs/SafetyState).

    Args:
        state: One or two words, for example "clear", "limited", "blocked".
        reason: A sentence for the pilot.
        allowed: (72,) float [m/s], the speed allowed in each direction, see `SECTORS`.
        gap: Distance to the nearest thing [m]; NaN when unknown.
        sector: The direction of that thing; None when there is none.
        command_age: Age of the newest command at this decision [s].
        given: Velocity that the wheels were given: forward, left [m/s], counter-clockwise [rad/s].
        scanning: Whether the body swings so that the beams see everything.
    """

    state: str
    reason: str
    allowed: np.ndarray
    gap: float
    sector: int | None
    command_age: float
    given: tuple[float, float, float]
    scanning: bool
    arrived: float

    def allowed_towards(self, bearing: float) -> float:
        """Return the speed [m/s] that is allowed in this direction [rad]."""
        return float(self.allowed[round(bearing / (2.0 * math.pi) * SECTORS) % SECTORS])


@dataclass(frozen=True)
class Careful:
    """The switch of the careful scan (topic careful, see telepresence_ros.careful_switch).

    Args:
        on: Whether the body sways while the robot drives.
        by_default: Nobody has chosen yet.
        unavailable: Why the gate has none; empty if it has one.
    """

    on: bool
    by_default: bool
    unavailable: str = ""


@dataclass(frozen=True)
class BodyState:
    """Position [m] and attitude [rad] of the body in `frame`, and its velocity in its own frame [m/s, rad/s]."""

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float
    vx: float
    vy: float
    wz: float
    frame: str = "odom"
    arrived: float = 0.0


@dataclass(frozen=True)
class TruePose:
    """Position [m] and attitude [rad] of a simulated body in the world: the truth, not a measurement."""

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float
    arrived: float


@dataclass(frozen=True)
class Battery:
    """`share` is the charge, 0 to 1, or NaN; `voltage` [V] or NaN."""

    share: float
    voltage: float
    charging: bool
    low: bool
    arrived: float


@dataclass(frozen=True)
class DriveState:
    """What the driver says about itself: "driving", "stopped: why", "robot unreachable: why"."""

    text: str
    arrived: float


@dataclass(frozen=True)
class PageState:
    """The state of the program that serves the tablet's page, and the address of the page."""

    text: str
    page: str
    arrived: float


@dataclass(frozen=True)
class PostureResult:
    """Whether a requested posture was reached, and if not why."""

    ok: bool
    text: str
    arrived: float


@dataclass(frozen=True)
class Levels:
    """The loudness at the pilot's and the robot's microphone [dBFS]; 0 is the loudest possible."""

    pilot: float
    robot: float
    arrived: float


@dataclass(frozen=True)
class VoiceState:
    """What the sound program says about itself."""

    text: str
    arrived: float


@dataclass(frozen=True)
class VoiceSettings:
    """What is muted, which devices are in use, and which could be; see `telepresence.audio.devices`."""

    microphone_muted: bool
    speaker_muted: bool
    microphone: str
    speaker: str
    microphones: tuple[str, ...]
    speakers: tuple[str, ...]


@dataclass(frozen=True)
class Lens:
    """How a camera maps directions to pixels (sensor_msgs/CameraInfo, without distortion).

    Args:
        fx, fy, cx, cy: Focal lengths and principal point [px].
        width, height: Size of the picture [px].
        frame: The camera's optical frame.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    frame: str = ""


@dataclass(frozen=True)
class CameraView:
    """The pose of a camera at one moment, in a frame whose plane z = 0 is the floor.

    Args:
        rotation: (3, 3) float; columns are the optical axes x right, y down, z ahead, in that frame.
        place: (3,) float [m], the optical centre in that frame.
    """

    lens: Lens
    rotation: np.ndarray = field(repr=False)
    place: np.ndarray


@dataclass(frozen=True)
class Pose:
    """A place and a heading on the floor [m, m, rad]."""

    x: float
    y: float
    theta: float
