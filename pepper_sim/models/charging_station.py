"""The charging station: a low post with a marker that cameras find, and contacts on the floor in front of it.

Its shape and its marker are our own. The robot docks backwards: its back to the post, its wheels on the contacts.
"""

from __future__ import annotations

import math

import mujoco

BODY = "charging_station"
MARKER_WIDTH, MARKER_HEIGHT, MARKER_BOTTOM = 0.40, 0.26, 0.06
"""Size of the marker and height of its lower edge above the floor [m]."""
MARKER_BEHIND = 0.40
"""The marker is so far behind the middle of a docked robot [m]: its back, and the distance that the base keeps."""

_MAGENTA = (0.9, 0.0, 0.9, 1.0)
_GREY = (0.25, 0.26, 0.28, 1.0)


def add_station(spec: mujoco.MjSpec, x: float, y: float, theta: float) -> None:
    """Put a station into a robot's model, fixed to the world.

    Args:
        x, y, theta: Pose of a docked robot's base_footprint [m, m, rad], where the model's base_footprint is 0.
    """
    for name, colour, emission in (("station_marker", _MAGENTA, 0.4), ("station_case", _GREY, 0.0)):
        spec.add_material(name=name, rgba=colour, emission=emission, specular=0.0)
    body = spec.worldbody.add_body(
        name=BODY, pos=(x, y, 0.0), quat=(math.cos(theta / 2), 0.0, 0.0, math.sin(theta / 2))
    )
    box = mujoco.mjtGeom.mjGEOM_BOX
    height = MARKER_BOTTOM + MARKER_HEIGHT + 0.04
    thickness = 0.03
    body.add_geom(
        name="station_post",
        type=box,
        pos=(-MARKER_BEHIND - thickness - 0.002, 0.0, height / 2),
        size=(thickness, MARKER_WIDTH / 2 + 0.04, height / 2),
        material="station_case",
    )
    body.add_geom(
        name="station_marker",
        type=box,
        pos=(-MARKER_BEHIND - 0.001, 0.0, MARKER_BOTTOM + MARKER_HEIGHT / 2),
        size=(0.001, MARKER_WIDTH / 2, MARKER_HEIGHT / 2),
        material="station_marker",
        contype=0,
        conaffinity=0,
    )
    body.add_geom(
        name="station_contacts",
        type=box,
        pos=(-MARKER_BEHIND + 0.1, 0.0, 0.002),
        size=(0.1, 0.06, 0.002),
        material="station_case",
        contype=0,
        conaffinity=0,
    )
