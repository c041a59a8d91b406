"""What the robot tells, as plain data: the link makes these of messages, widgets paint them. No ROS, no Qt.

Places are in the robot's base frame on the floor under it (x forward, y left, z up) or in `odom`; SI units; `arrived`
is when the message came here [monotonic s].
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

SECTORS = 72
"""Directions of `Safety.allowed`; sector k is centred k * 5 degrees counter-clockwise from x."""


@dataclass(frozen=True)
class Points:
    """Where a scanner hit something: (n, 2) float [m], base frame."""

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
        reach: [m] as far as a beam sees.
    """

    source: str
    starts: np.ndarray
    bearings: np.ndarray
    ranges: np.ndarray
    reach: float
    arrived: float


@dataclass(frozen=True)
class Cone:
    """One sonar: from (x, y) [m] to `bearing` [rad], `width` [rad] wide; range as in `Beams` [m]."""

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
    """Names of the bumpers that are pressed: left, right, back, or ring for one all around."""

    pressed: frozenset[str]
    arrived: float


@dataclass(frozen=True)
class Safety:
    """One decision of the safety gate (telepresence_msgs/SafetyState).

    Args:
        state: One word or two, for example "free", "slowed", "blocked".
        reason: A sentence for the pilot.
        allowed: (72,) float [m/s], see `SECTORS`.
        gap: Free room towards the nearest thing [m]; NaN when unknown.
        sector: Where that is; None when nowhere.
        command_age: [s] of the newest command when this was decided.
        given: What the wheels were given: forward, left [m/s], counter-clockwise [rad/s].
        scanning: The body swings so that the beams see everything.
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
        """Speed [m/s] that is allowed in this direction [rad]."""
        return float(self.allowed[round(bearing / (2.0 * math.pi) * SECTORS) % SECTORS])


@dataclass(frozen=True)
class BodyState:
    """Where the body is in `frame` [m], how it is turned [rad], and how fast it goes in its own frame [m/s, rad/s]."""

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
class Battery:
    """`share` 0 to 1 or NaN; `voltage` [V] or NaN."""

    share: float
    voltage: float
    charging: bool
    low: bool
    arrived: float


@dataclass(frozen=True)
class DriveState:
    """The driver's own words: "driving", "stopped: why", "robot unreachable: why"."""

    text: str
    arrived: float


@dataclass(frozen=True)
class PageState:
    """The program that serves the tablet's page: how it is, and where the page is."""

    text: str
    page: str
    arrived: float


@dataclass(frozen=True)
class PostureResult:
    """What became of a posture that was asked for."""

    ok: bool
    text: str
    arrived: float


@dataclass(frozen=True)
class Levels:
    """Loudness of the pilot's and the robot's microphone [dBFS], 0 is the loudest there is."""

    pilot: float
    robot: float
    arrived: float


@dataclass(frozen=True)
class VoiceState:
    """The sound program's own words."""

    text: str
    arrived: float


@dataclass(frozen=True)
class VoiceSettings:
    """What is muted, and which devices are chosen and could be: see `telepresence.audio.devices`."""

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
        fx, fy, cx, cy: Focal lengths and middle [px].
        width, height: Of the picture [px].
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
    """A camera at one moment, seen from a frame whose plane z = 0 is the floor.

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
