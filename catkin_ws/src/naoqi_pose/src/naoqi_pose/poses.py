"""Named poses from a parameter.

Each is a mapping with joint_names, positions [rad, hands 0 to 1] and time_from_start [s]; for several points,
positions is a list of lists and time_from_start a list.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple


class Pose(NamedTuple):
    """A trajectory: joints, and points of time from the start [s] and positions."""

    joint_names: list[str]
    points: list[tuple[float, list[float]]]


class UnusablePose(ValueError):
    """A pose is not written as it should be."""


def read_poses(content: Mapping[str, Any]) -> dict[str, Pose]:
    """All poses of the parameter.

    Raises:
        UnusablePose: The text names the pose and what is wrong with it.
    """
    return {name: _read_pose(name, pose) for name, pose in content.items()}


def _read_pose(name: str, pose: Any) -> Pose:
    try:
        joints = [str(joint) for joint in pose["joint_names"]]
        positions, times = pose["positions"], pose["time_from_start"]
        if not isinstance(times, Sequence):
            positions, times = [positions], [times]
        points = [(float(time), [float(part) for part in point]) for time, point in zip(times, positions, strict=True)]
    except KeyError as error:
        raise UnusablePose(f"pose {name}: {error} is missing") from None
    except (TypeError, ValueError) as error:
        raise UnusablePose(f"pose {name}: {error}") from None
    for _, point in points:
        if len(point) != len(joints):
            raise UnusablePose(f"pose {name}: {len(point)} positions for {len(joints)} joints")
    return Pose(joints, points)
