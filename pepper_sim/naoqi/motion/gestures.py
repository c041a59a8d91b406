"""A few gestures of our own under the names that programs use: waving, nodding, shaking the head, bowing, explaining.

A gesture is joint -> [(seconds, angle [rad])]; `playable` appends the way back to where the joints were.
"""

from __future__ import annotations

from collections.abc import Mapping

Gesture = Mapping[str, tuple[tuple[float, float], ...]]

_WAVE: Gesture = {
    "RShoulderPitch": ((0.8, -0.4), (2.6, -0.4)),
    "RShoulderRoll": ((0.8, -0.3), (2.6, -0.3)),
    "RElbowYaw": ((0.8, 1.6), (2.6, 1.6)),
    "RElbowRoll": ((0.8, 1.1), (1.2, 0.6), (1.6, 1.2), (2.0, 0.6), (2.6, 1.1)),
    "RWristYaw": ((0.8, 0.0), (2.6, 0.0)),
    "RHand": ((0.8, 0.98), (2.6, 0.98)),
    "HeadPitch": ((0.8, -0.25), (2.6, -0.25)),
}
_NOD: Gesture = {"HeadPitch": ((0.3, 0.2), (0.6, -0.15), (0.9, 0.2), (1.2, -0.15))}
_SHAKE: Gesture = {"HeadYaw": ((0.3, 0.4), (0.8, -0.4), (1.3, 0.4))}
_BOW: Gesture = {
    "HipPitch": ((0.9, -0.5), (1.5, -0.5)),
    "HeadPitch": ((0.9, 0.3), (1.5, 0.3)),
}
_EXPLAIN: Gesture = {
    "LShoulderPitch": ((0.6, 0.9), (1.4, 0.8)),
    "LElbowRoll": ((0.6, -1.2), (1.4, -0.9)),
    "LElbowYaw": ((0.6, -1.5), (1.4, -1.7)),
    "LHand": ((0.6, 0.98), (1.4, 0.98)),
    "RShoulderPitch": ((0.6, 0.9), (1.4, 0.8)),
    "RElbowRoll": ((0.6, 1.2), (1.4, 0.9)),
    "RElbowYaw": ((0.6, 1.5), (1.4, 1.7)),
    "RHand": ((0.6, 0.98), (1.4, 0.98)),
}

_FOLDER = "animations/Stand/Gestures/"
GESTURES: dict[str, Gesture] = {
    **{f"{_FOLDER}Hey_{number}": _WAVE for number in (1, 3, 4, 6)},
    **{f"{_FOLDER}Yes_{number}": _NOD for number in (1, 2, 3)},
    **{f"{_FOLDER}No_{number}": _SHAKE for number in (1, 3, 8, 9)},
    f"{_FOLDER}BowShort_1": _BOW,
    **{f"{_FOLDER}Explain_{number}": _EXPLAIN for number in (1, 2, 3, 4, 5)},
}
"""Path of an animation -> gesture."""

TAGS: dict[str, str] = {
    **dict.fromkeys(("hey", "hello", "hi", "bye", "greet"), f"{_FOLDER}Hey_1"),
    **dict.fromkeys(("yes", "affirmative", "ok"), f"{_FOLDER}Yes_1"),
    **dict.fromkeys(("no", "negative"), f"{_FOLDER}No_1"),
    **dict.fromkeys(("bow", "polite"), f"{_FOLDER}BowShort_1"),
    **dict.fromkeys(("explain", "body language"), f"{_FOLDER}Explain_1"),
}
"""Tag -> path of the animation that carries it."""

RETURN_TIME = 0.7
"""Time of the way back after the last knot [s]."""


def playable(gesture: Gesture, start: Mapping[str, float]) -> dict[str, list[tuple[float, float]]]:
    """Return the knots of a gesture with the way back to `start` (joint -> angle)."""
    return {joint: [*knots, (knots[-1][0] + RETURN_TIME, float(start[joint]))] for joint, knots in gesture.items()}
