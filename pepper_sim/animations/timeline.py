"""Timelines that users drew: Choregraphe's behaviours (.xar) and the animation editor's files (.qianim).

Both hold one curve per joint: keys at frames, with Bezier handles or without. Format: files that Choregraphe 2.1 to 2.5
and the animation editor write; a curve's unit is "degree" or 0, "radian", or "dimensionless" or 1 (hands).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pepper_sim.body.description import LIMITS
from pepper_sim.body.joints import MAX_TRAJECTORY
from pepper_sim.naoqi.motion.bezier import bezier_knots
from pepper_sim.naoqi.service import ServiceError

MAX_BYTES = 20_000_000
_DEFAULT_FPS = 25.0
_RAW_UNITS = ("1", "dimensionless", "radian")
_DEGREES = ("0", "degree", "")

Handle = tuple[float, float]


class NotReadable(ServiceError):
    """A file is no behaviour or animation; the text names it and says why."""


@dataclass(frozen=True)
class Key:
    """A point of a curve: seconds from the start, angle [rad], and its handles relative to it, left and right."""

    moment: float
    angle: float
    left: Handle = (0.0, 0.0)
    right: Handle = (0.0, 0.0)


@dataclass(frozen=True)
class Timeline:
    """Curves of some joints, and how long they take [s]."""

    curves: Mapping[str, tuple[Key, ...]]
    duration: float

    def knots(self, start: Mapping[str, float]) -> dict[str, list[tuple[float, float]]]:
        """Return joint -> (seconds from the start, angle) of a motion that begins at the angles `start`."""
        knots = {}
        for joint, keys in self.curves.items():
            points = [[key.angle, [2, *key.left], [2, *key.right]] for key in keys]
            knots[joint] = bezier_knots(start[joint], [key.moment for key in keys], points, joint)
            if knots[joint][-1][0] < self.duration:
                knots[joint].append((self.duration, keys[-1].angle))
        return knots


def read_qianim(file: Path) -> Timeline:
    """Read a file of the animation editor.

    Raises: NotReadable: It is none.
    """
    root = parse_xml(file)
    if root.tag != "Animation":
        raise NotReadable(f"{file.name} is no animation: its first element is '{root.tag[:40]}'")
    fps = _number(root, "fps", 0.0, file)
    return read_curves(root, fps or _DEFAULT_FPS, 0.0, math.inf, file)


def read_curves(parent: ElementTree.Element, fps: float, first: float, last: float, file: Path) -> Timeline:
    """Read the curves of `parent`, but not those of boxes inside it, from the frame `first` to the frame `last`.

    Raises: NotReadable: A curve has an invalid joint, unit or number, or lasts too long.
    """
    curves: dict[str, tuple[Key, ...]] = {}
    for curve in (*parent.iterfind("ActuatorCurve"), *parent.iterfind("ActuatorList/ActuatorCurve")):
        joint = curve.get("actuator", "")
        if curve.get("mute", "0").lower() in ("1", "true"):
            continue
        if joint not in LIMITS:
            if joint.startswith(("LAnkle", "RAnkle", "LHip", "RHip", "LKnee", "RKnee")):
                continue  # drawn for the two-legged robot
            raise NotReadable(f"{file.name}: this robot has no joint '{joint[:40]}'")
        unit = curve.get("unit", "0")
        if unit not in _RAW_UNITS + _DEGREES:
            raise NotReadable(f"{file.name}: unknown unit '{unit[:20]}' of {joint}")
        scale = math.radians(1.0) if unit in _DEGREES and not joint.endswith("Hand") else 1.0
        rate = _number(curve, "fps", fps, file) or fps
        keys = sorted(_keys(curve, rate, scale, first, last, file), key=lambda key: key.moment)
        if keys:
            curves[joint] = tuple(keys)
    duration = max((keys[-1].moment for keys in curves.values()), default=0.0)
    if duration > MAX_TRAJECTORY:  # before it is sampled, which takes memory for each of its frames
        raise NotReadable(f"{file.name} lasts {duration:.0f} s; at most {MAX_TRAJECTORY:.0f} s are possible")
    return Timeline(curves, duration)


def parse_xml(file: Path) -> ElementTree.Element:
    """Parse a file; the names of its elements lose their namespaces.

    Raises: NotReadable: It is missing, too large, or no XML.
    """
    try:
        if file.stat().st_size > MAX_BYTES:
            raise NotReadable(f"{file.name} is larger than {MAX_BYTES} bytes")
        root = ElementTree.fromstring(file.read_bytes())
    except (OSError, ElementTree.ParseError) as error:
        raise NotReadable(f"{file.name} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    return root


def _keys(curve: ElementTree.Element, rate: float, scale: float, first: float, last: float, file: Path) -> list[Key]:
    keys = []
    for key in curve.iterfind("Key"):
        frame = _number(key, "frame", 0.0, file)
        if not first <= frame <= last:
            continue
        handles = {"left": (0.0, 0.0), "right": (0.0, 0.0)}
        for tangent in key.iterfind("Tangent"):
            time = _number(tangent, "abscissaParam", 0.0, file) / rate
            handles[tangent.get("side", "")] = (time, _number(tangent, "ordinateParam", 0.0, file) * scale)
        # A key in the first frame is reached at once, not before the motion begins.
        moment = max(frame - max(first - 1.0, 0.0), 0.5) / rate
        keys.append(Key(moment, _number(key, "value", 0.0, file) * scale, handles["left"], handles["right"]))
    return keys


def _number(element: ElementTree.Element, name: str, default: float, file: Path) -> float:
    text = element.get(name)
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise NotReadable(f"{file.name}: {element.tag} has the {name} '{text[:20]}'")
    return value
