"""Joint trajectories as ALMotion takes them.

Wire (NAOqi 2.8 documentation, ALMotion): `angleInterpolation(names, angles, times, absolute)` and
`stiffnessInterpolation(names, values, times)` take a list of names and, for each, a list of values and a list of times
[s] from now.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple


class Interpolation(NamedTuple):
    """Arguments of angleInterpolation: `values[i]` are reached by joint `names[i]` at `times[i]` [s]."""

    names: list[str]
    values: list[list[float]]
    times: list[list[float]]

    @property
    def duration(self) -> float:
        return max(times[-1] for times in self.times)


class UnusableTrajectory(ValueError):
    """The trajectory contradicts itself or cannot be carried out."""


def to_interpolation(
    names: Sequence[str],
    points: Sequence[tuple[float, Sequence[float]]],
    expand: Callable[[str], Sequence[str]],
) -> Interpolation:
    """A trajectory as arguments for the robot.

    Args:
        names: Joints, or one group of joints such as "Head".
        points: Time from the start [s] and one value per joint; a single value goes to every joint.
        expand: The joints of a group; called only if there are more values than names.
    Raises:
        UnusableTrajectory: The text says which point is wrong and why.
    """
    names = [str(name) for name in names]
    if not names or not points:
        raise UnusableTrajectory("a trajectory needs joints and points")
    width = len(points[0][1])
    if width not in (1, len(names)):
        names = [joint for name in names for joint in expand(name)]
    if width not in (1, len(names)):
        raise UnusableTrajectory(f"{width} values for {len(names)} joints: {', '.join(names)}")
    before = 0.0
    for number, (time, values) in enumerate(points, 1):
        if len(values) != width:
            raise UnusableTrajectory(f"point {number} has {len(values)} values, the first has {width}")
        if not all(math.isfinite(value) for value in values):
            raise UnusableTrajectory(f"point {number} holds a value that is not finite")
        if not (math.isfinite(time) and time > before):
            raise UnusableTrajectory(
                f"point {number} is due {time:g} s from the start, which is not after {before:g} s"
            )
        before = time
    times = [float(time) for time, _ in points]
    columns = range(len(names)) if width == len(names) else [0] * len(names)
    return Interpolation(names, [[float(values[i]) for _, values in points] for i in columns], [times] * len(names))
