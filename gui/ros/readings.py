"""What a robot publishes, as plain data: `gui.ros.topics` converts messages to these, widgets paint them.
What the pilot's page needs, too, is in `telepresence.teleop.robot_readings`.

Positions are in the robot's base frame on the floor under it (x forward, y left, z up) or in `odom`; SI units;
`arrived` is when the message arrived here [monotonic s]. No ROS, no Qt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from telepresence.audio.voice_state import NO_CONVERSATION
from telepresence.teleop.robot_readings import SECTORS, Battery, BodyState, CameraView, Lens, Safety

__all__ = [
    "SECTORS",
    "Battery",
    "Beams",
    "BodyState",
    "Bumpers",
    "CameraView",
    "Careful",
    "Cone",
    "DriveState",
    "Lens",
    "Levels",
    "PageState",
    "Points",
    "Pose",
    "PostureResult",
    "Safety",
    "TruePose",
    "VoiceSettings",
    "VoiceState",
]


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
class DriveState:
    """What the driver says about itself: "driving", "stopped: why", "robot unreachable: why"."""

    text: str
    arrived: float


@dataclass(frozen=True)
class PageState:
    """The state of the program that serves the tablet's page, the address of the page, and whether the tablet shall
    show it."""

    text: str
    page: str
    on: bool
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

    @property
    def on(self) -> bool:
        """Whether there is a conversation."""
        return self.text != NO_CONVERSATION


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
class Pose:
    """A place and a heading on the floor [m, m, rad]."""

    x: float
    y: float
    theta: float
