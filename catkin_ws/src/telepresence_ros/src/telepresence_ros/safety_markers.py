"""A safety decision as markers for RViz: outline, ring of allowed speeds, known obstacles, velocity, state.

The ring has the gate's 72 sectors. Each is as long as the speed that is allowed that way, and coloured: red for none,
green for the robot's top speed. The sector of the obstacle that limits most is drawn in white.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from telepresence.safety import SECTORS, Decision, Outline, RobotProfile, State

LIFETIME = 0.5
"""Markers vanish this long after the last drawing [s]: nobody shall trust those of a dead node."""
HEIGHT = 0.02
"""Over the floor, so that a ground grid doesn't flicker through [m]."""
RING_GAP, RING_WIDTH, RING_LEAST = 0.03, 0.30, 0.02
"""The ring begins this far outside the outline's circle; its length at top speed, and where nothing is allowed [m]."""
TEXT_HEIGHT = 0.08
"""Height of a capital letter [m]."""
ARROW_TIME = 1.0
"""The arrow reaches as far as the robot would drive in this time [s]."""
WHITE = (1.0, 1.0, 1.0, 1.0)
STATE_COLOURS = {
    State.CLEAR: (0.2, 0.8, 0.3, 1.0),
    State.LIMITED: (1.0, 0.75, 0.1, 1.0),
    State.NO_COMMAND: (0.6, 0.6, 0.6, 1.0),
}
"""All other states are red."""
RED = (0.95, 0.15, 0.15, 1.0)


def draw(
    profile: RobotProfile, decision: Decision, obstacles: np.ndarray, frame_id: str, stamp: rospy.Time
) -> MarkerArray:
    """
    Args:
        profile: The robot.
        decision: What to show.
        obstacles: (n, 2) known obstacles in `frame_id` [m].
        frame_id: tf frame of the robot's base.
        stamp: Of the decision.
    """
    colour = STATE_COLOURS.get(decision.state, RED)
    markers = (
        _outline(profile.outline, colour),
        _ring(profile, decision),
        _obstacle_dots(obstacles),
        _velocity(decision, colour),
        _text(profile.outline, decision, colour),
    )
    for number, marker in enumerate(markers):
        marker.header.frame_id, marker.header.stamp = frame_id, stamp
        marker.ns, marker.id = "safety", number
        marker.lifetime = rospy.Duration(LIFETIME)
        marker.pose.orientation.w = 1.0
        marker.frame_locked = True
    return MarkerArray(list(markers))


def _outline(outline: Outline, colour: Sequence[float]) -> Marker:
    marker = Marker(type=Marker.LINE_STRIP, color=ColorRGBA(*colour))
    marker.scale.x = 0.01
    marker.points = [Point(x, y, HEIGHT) for x, y in _rim(outline)]
    return marker


@lru_cache
def _rim(outline: Outline) -> tuple[tuple[float, float], ...]:
    bearings = np.linspace(0.0, math.tau, SECTORS + 1)
    rim = outline.reach(bearings)[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    return tuple(map(tuple, rim.tolist()))


def _ring(profile: RobotProfile, decision: Decision) -> Marker:
    """Two triangles per sector."""
    marker = Marker(type=Marker.TRIANGLE_LIST, color=ColorRGBA(*WHITE))
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    inner = profile.outline.outer_radius + RING_GAP
    half = math.pi / SECTORS
    for sector, allowed in enumerate(decision.allowed):
        share = min(1.0, max(0.0, float(allowed) / profile.limits.max_speed)) if math.isfinite(allowed) else 0.0
        outer = inner + RING_LEAST + share * (RING_WIDTH - RING_LEAST)
        left, right = sector * 2.0 * half + half, sector * 2.0 * half - half
        corners = [_point(inner, right), _point(outer, right), _point(outer, left), _point(inner, left)]
        marker.points += [corners[i] for i in (0, 1, 2, 0, 2, 3)]
        colour = WHITE if sector == decision.sector else _speed_colour(share)
        marker.colors += [ColorRGBA(*colour)] * 6
    return marker


def _obstacle_dots(obstacles: np.ndarray) -> Marker:
    marker = Marker(type=Marker.SPHERE_LIST, color=ColorRGBA(0.9, 0.3, 0.9, 1.0))
    marker.scale.x = marker.scale.y = marker.scale.z = 0.03
    marker.points = [Point(float(x), float(y), HEIGHT) for x, y in obstacles]
    if not len(obstacles):
        marker.action = Marker.DELETE
    return marker


def _velocity(decision: Decision, colour: Sequence[float]) -> Marker:
    marker = Marker(type=Marker.ARROW, color=ColorRGBA(*colour))
    marker.scale.x, marker.scale.y, marker.scale.z = 0.02, 0.05, 0.05
    marker.points = [Point(0.0, 0.0, HEIGHT), Point(decision.vx * ARROW_TIME, decision.vy * ARROW_TIME, HEIGHT)]
    if decision.speed < 1e-3:
        marker.action = Marker.DELETE
    return marker


def _text(outline: Outline, decision: Decision, colour: Sequence[float]) -> Marker:
    marker = Marker(type=Marker.TEXT_VIEW_FACING, color=ColorRGBA(*colour))
    marker.scale.z = TEXT_HEIGHT
    marker.pose.position.x = -outline.outer_radius - RING_WIDTH - 2.0 * TEXT_HEIGHT
    marker.pose.position.z = TEXT_HEIGHT
    marker.text = f"{decision.state.value}\n{decision.reason}"
    return marker


def _speed_colour(share: float) -> tuple[float, float, float, float]:
    """Red, amber, green."""
    return min(1.0, 2.0 - 2.0 * share), min(0.85, 1.7 * share), 0.1, 0.7


def _point(radius: float, bearing: float) -> Point:
    return Point(float(radius) * math.cos(bearing), float(radius) * math.sin(bearing), HEIGHT)
