"""Joint curves as Choregraphe exports them: Bezier segments in the plane of time and angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pepper_sim.naoqi.service import ServiceError, finite, shown

_SAMPLE_PERIOD = 0.04
_CURVE_POINTS = 33
_MIN_SPACING = 1e-3


def bezier_knots(start: float, moments: Sequence[float], points: Any, argument: str) -> list[tuple[float, float]]:
    """Sample the curve from `start` at time 0 through the control points.

    Args:
        start: Angle now [rad].
        moments: Times of the points [s], rising.
        points: Per time [angle, handle before, handle after]; a handle is [type, time, angle] relative to its point.
            Handles of a plain number, and missing ones, have length zero.
    Returns:
        (time, angle), times rising.
    Raises:
        ServiceError: A point is not of this form; names `argument`.
    """
    if not isinstance(points, list | tuple) or len(points) != len(moments):
        raise ServiceError(f"{argument} must hold one point for each of the {len(moments)} times")
    parsed = [_point(point, f"{argument}[{index}]") for index, point in enumerate(points)]
    time, angle, leaving = 0.0, start, (0.0, 0.0)
    knots: list[tuple[float, float]] = []
    for moment, (target, arriving, following) in zip(moments, parsed, strict=True):
        moment = max(moment, time + _MIN_SPACING)
        span = moment - time
        corners_t = [time, time + min(max(leaving[0], 0.0), span), moment + max(min(arriving[0], 0.0), -span), moment]
        corners_a = [angle, angle + leaving[1], target + arriving[1], target]
        knots += _samples(corners_t, corners_a)
        time, angle, leaving = moment, target, following
    return knots


def _samples(t: Sequence[float], a: Sequence[float]) -> list[tuple[float, float]]:
    """Sample a segment at equal times; its last point is exact. Its handles lie inside, so time never decreases."""
    u = np.linspace(0.0, 1.0, _CURVE_POINTS)
    weights = np.stack([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3])
    curve_t, curve_a = np.asarray(t) @ weights, np.asarray(a) @ weights
    inner = np.arange(t[0] + _SAMPLE_PERIOD, t[-1] - 0.5 * _SAMPLE_PERIOD, _SAMPLE_PERIOD)
    angles = np.interp(inner, curve_t, curve_a)
    return [*zip(inner.tolist(), angles.tolist(), strict=True), (float(t[-1]), float(a[-1]))]


def _point(value: Any, argument: str) -> tuple[float, tuple[float, float], tuple[float, float]]:
    if not isinstance(value, list | tuple):
        return finite(value, argument), (0.0, 0.0), (0.0, 0.0)
    if not 1 <= len(value) <= 3:
        raise ServiceError(f"{argument} must be [angle, handle, handle], got {shown(value)}")
    handles = [_handle(handle, argument) for handle in value[1:]]
    handles += [(0.0, 0.0)] * (2 - len(handles))
    return finite(value[0], argument), handles[0], handles[1]


def _handle(value: Any, argument: str) -> tuple[float, float]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ServiceError(f"{argument}: a handle is [type, time, angle], got {shown(value)}")
    return finite(value[1], argument), finite(value[2], argument)
