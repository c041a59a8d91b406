"""Draws an animation from its name: curves of our own, within the joints' limits and speeds.

`sketches.toml` says for every name which poses the arms, the head and the torso take, and when. The rest is in the
name: its number chooses the sketch, the arm, the pace and the size, so that Hey_1 and Hey_3 differ. An animation of the
body language is drawn by what it means, which are its tags; "Left", "Right" and "Center" in its name choose the arm,
"Slow", "Neutral" and "Strong" pace and size.
"""

from __future__ import annotations

import functools
import re
import tomllib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from pepper_sim.body.description import LIMITS
from pepper_sim.body.postures import STAND

Curves = Mapping[str, tuple[tuple[float, float], ...]]
"""Joint -> (seconds from the start, angle [rad]), times rising."""

LEAD = 0.8
"""Time of the way to the first pose [s]."""
RETURN_TIME = 0.8
"""Time of the way back after the last pose [s]."""
SPEED_SHARE = 0.45
"""Fraction of a joint's top speed that a curve uses at most; a robot on wheels moves its torso slower, or it would tip,
and the wrists' motors are weak."""
TORSO_SPEED, WRIST_SPEED = 0.5, 3.0
"""[rad/s]"""

_FILE = Path(__file__).with_name("sketches.toml")
_PEAK_OVER_MEAN_SPEED = 1.5
_HOLD = 0.5  # of a pose that is the only one [s]
_MARGIN = 0.01  # between curve and limit [rad]
_ARM = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw", "Hand")
_ARM_SIGNS = {"R": (1, -1, 1, 1, 1, 1), "L": (1, 1, -1, -1, -1, 1)}
_HEAD = ("HeadYaw", "HeadPitch")
_TORSO = ("HipRoll", "HipPitch", "KneePitch")
_OTHER = {"L": "R", "R": "L"}

_BODY_LANGUAGE = re.compile(r"(Left|Right|Center)_(Slow|Neutral|Strong)_[A-Z]+_(\d+)")
_NAME = re.compile(r"([A-Za-z]+?)(?:_?(\d+))?")
_STYLES = {"Slow": (1.35, 0.85), "Neutral": (1.0, 1.0), "Strong": (0.85, 1.15)}
"""Style -> (pace, size)."""
_PACES = (1.0, 1.1, 0.95, 1.05, 0.9)
_SIZES = (1.0, 0.92, 1.06, 0.96, 1.03)
"""Pace and size of the variants 1, 2, 3 ... of one sketch."""


@dataclass(frozen=True)
class _Style:
    arms: str
    """The arms that part A moves: "R", "L" or "RL"."""
    pace: float
    size: float
    sketch: str

    @property
    def side(self) -> str:
        return self.arms[0]


def draw(name: str, tags: Collection[str] = ()) -> Curves:
    """Return the curves of the animation `name`, such as "Hey_1" or "Left_Strong_SAT_02".

    Args:
        tags: What the animation means; used for the body language only.
    Raises:
        KeyError: There is no sketch for it, or a sketch names an unknown pose.
    """
    style = _style(name, tags)
    *parts, beat = (part.strip() for part in style.sketch.split(";"))
    step = float(beat)
    tracks = {part[0]: [_pose(part[0], pose, style) for pose in part[1:].split()] for part in parts}
    longest = max(len(poses) for poses in tracks.values())
    times = _times(tracks.values(), longest, step, style.pace)
    end = times[-1] + (_HOLD * style.pace if longest == 1 else 0.0)
    curves: dict[str, tuple[tuple[float, float], ...]] = {}
    for poses in tracks.values():
        for joint in poses[0]:
            points = [(moment, pose[joint]) for moment, pose in zip(times, poses, strict=False)]
            if points[-1][0] < end:
                points.append((end, points[-1][1]))
            curves[joint] = tuple(points)
    return curves


Knots = dict[str, list[tuple[float, float]]]


def playable(curves: Curves, start: Mapping[str, float], end: Mapping[str, float]) -> Knots:
    """Return the knots of an animation that begins where the joints are and goes back to `end`.

    Args:
        start: Joint -> where it is when the animation begins; the way to the first pose takes as long as it must.
        end: Joint -> where it is afterwards.
    """
    knots = leading(curves, start)
    last = max(points[-1][0] for points in knots.values())
    back = max([RETURN_TIME, *(_least_time(joint, end[joint] - points[-1][1]) for joint, points in knots.items())])
    for joint, points in knots.items():
        if points[-1][0] < last:
            points.append((last, points[-1][1]))
        points.append((last + back, float(end[joint])))
    return knots


def leading(curves: Curves, start: Mapping[str, float]) -> Knots:
    """Return the knots of an animation that begins where the joints are and ends in its last pose."""
    delay = max(
        [0.0, *(_least_time(joint, points[0][1] - start[joint]) - points[0][0] for joint, points in curves.items())]
    )
    return {joint: [(moment + delay, angle) for moment, angle in points] for joint, points in curves.items()}


def way(start: Mapping[str, float], end: Mapping[str, float], joints: Iterable[str]) -> Knots:
    """Return the knots of a calm way of some joints from `start` to `end`."""
    joints = list(joints)
    time = max([RETURN_TIME, *(_least_time(joint, end[joint] - start[joint]) for joint in joints)])
    return {joint: [(time, float(end[joint]))] for joint in joints}


def _style(name: str, tags: Collection[str]) -> _Style:
    match = _BODY_LANGUAGE.fullmatch(name)
    if match:
        side, manner, digits = match.groups()
        number = int(digits)
        pace, size = _STYLES[manner]
        arms = {"Left": "L", "Right": "R", "Center": "RL"}[side]
        meanings = _sheet()["body_language"]
        sketches = next((sketch for tag, sketch in meanings.items() if tag in tags), None)
        if sketches is None:
            raise KeyError(f"{name} has none of the tags {', '.join(meanings)}")
    else:
        match = _NAME.fullmatch(name)
        if match is None:
            raise KeyError(f"{name!r} is no name of an animation")
        kind, digits = match.groups()
        number = int(digits or 1)
        pace = size = 1.0
        arms = "L" if kind.endswith("Left") or (number % 2 == 0 and not kind.endswith("Right")) else "R"
        sketches = _sheet()["sketch"][kind]
    variants = [sketches] if isinstance(sketches, str) else sketches
    chosen = variants[(number - 1) % len(variants)]
    variant = (number - 1) // len(variants) + (number - 1)
    return _Style(arms, pace * _PACES[variant % len(_PACES)], size * _SIZES[variant % len(_SIZES)], chosen)


def _pose(part: str, pose: str, style: _Style) -> dict[str, float]:
    """Return joint -> angle of a pose of a part of the body."""
    mirror = 1.0 if style.side == "R" else -1.0
    if part == "H":
        yaw, pitch = _sheet()["head"][pose]
        return _sized(dict(zip(_HEAD, (yaw * mirror, pitch), strict=True)), style.size)
    if part == "T":
        roll, *pitches = _sheet()["torso"][pose]
        return _sized(dict(zip(_TORSO, (roll * mirror, *pitches), strict=True)), style.size)
    arms = {"A": style.arms, "O": _OTHER[style.side], "B": "RL"}.get(part, part)
    angles = {
        arm + joint: sign * angle
        for arm in arms
        for joint, sign, angle in zip(_ARM, _ARM_SIGNS[arm], _sheet()["arm"][pose], strict=True)
    }
    return _sized(angles, style.size)


def _sized(angles: Mapping[str, float], size: float) -> dict[str, float]:
    """Scale the distance to the standing robot's angles, within the limits."""
    scaled = {joint: STAND[joint] + size * (angle - STAND[joint]) for joint, angle in angles.items()}
    return {
        joint: round(min(max(angle, LIMITS[joint].lower + _MARGIN), LIMITS[joint].upper - _MARGIN), 4)
        for joint, angle in scaled.items()
    }


def _times(tracks: Iterable[list[dict[str, float]]], count: int, step: float, pace: float) -> list[float]:
    """Return when the poses are reached: `step` apart at this pace, or later where a joint needs longer."""
    times = [LEAD]
    for index in range(1, count):
        needed = [
            _least_time(joint, poses[index][joint] - poses[index - 1][joint])
            for poses in tracks
            if index < len(poses)
            for joint in poses[index]
        ]
        times.append(round(times[-1] + max([step * pace, *(least * max(pace, 1.0) for least in needed)]), 3))
    return times


def _least_time(joint: str, distance: float) -> float:
    speed = SPEED_SHARE * LIMITS[joint].velocity
    if joint in _TORSO:
        speed = TORSO_SPEED
    elif joint.endswith("WristYaw"):
        speed = WRIST_SPEED
    return _PEAK_OVER_MEAN_SPEED * abs(distance) / speed


@functools.cache
def _sheet() -> dict:
    return tomllib.loads(_FILE.read_text(encoding="utf-8"))
