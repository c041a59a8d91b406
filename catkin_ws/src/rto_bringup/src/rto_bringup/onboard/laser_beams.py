"""A scan of the robot's laser as the beams that the gate's profile has: their order, from the robot's middle."""

from __future__ import annotations

import math

import numpy as np
from rto_node.client import Scan
from rto_node.robot_facts import LASER_MOUNT

from telepresence.safety import ROBOTINO_LASER, UNKNOWN

LASER = ROBOTINO_LASER.source("laser")


FEWEST_RETURNS = 0.05
"""Share of a scan's rays with a return below which the scanner is taken for blind."""
GAP = math.radians(5.0)
"""A ray without a return is far when returns no farther from it than this, on both sides, are [rad]."""
FAR = LASER.max_range + LASER_MOUNT
"""From here on a return limits nothing [m]."""
INSIDE = ROBOTINO_LASER.outline.outer_radius - 0.03
"""A return nearer to the robot's middle than this is of the robot itself, a cap on the scanner say [m]."""


def ranges_of_beams(scan: Scan) -> list[float]:
    """The nearest return in the sector of each of the gate's beams, in their order.

    Args:
        scan: Range 0 is no return (a real robot's scan0): nothing within reach, but as well something black, shiny or
            too near, or a cap on the scanner.
    Returns:
        [m] from the robot's middle; `UNKNOWN` where no ray points (the scanners that robots have been seen with look
        110 degrees to either side), and where what the rays say cannot be told from blindness.
    """
    ranges = np.array(scan.ranges, float)
    bearings = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    x, y = LASER_MOUNT + ranges * np.cos(bearings), ranges * np.sin(bearings)
    away = np.hypot(x, y)
    returned = (ranges > scan.range_min) & (ranges < scan.range_max) & (away > INSIDE)
    if np.count_nonzero(returned) <= FEWEST_RETURNS * len(ranges):
        return np.full(LASER.beams, UNKNOWN).tolist()
    reach = np.where(returned, ranges, scan.range_max)
    ends = np.stack([LASER_MOUNT + reach * np.cos(bearings), reach * np.sin(bearings)], axis=1)
    # The beam whose direction is nearest is the one with the largest projection.
    beam = (ends @ LASER.directions.T).argmax(axis=1)
    found = np.full(LASER.beams, np.inf)
    np.minimum.at(found, beam[returned], away[returned])
    rays = np.bincount(beam, minlength=LASER.beams)
    known = np.bincount(beam[returned | _between_far_ones(ranges, returned, bearings)], minlength=LASER.beams)
    # Something near is believed from a single ray, free space from most of them.
    believed = (found < FAR) | ((rays > 0) & (2 * known > rays))
    return np.where(believed, np.minimum(found, scan.range_max), UNKNOWN).tolist()


def _between_far_ones(ranges: np.ndarray, returned: np.ndarray, bearings: np.ndarray) -> np.ndarray:
    """Return which rays have a far return near by on both sides."""
    index, places = np.arange(len(ranges)), np.flatnonzero(returned)
    after = np.searchsorted(places, index)
    inside = (after > 0) & (after < len(places))
    before, after = places[np.maximum(after - 1, 0)], places[np.minimum(after, len(places) - 1)]
    far = (ranges[before] >= FAR) & (ranges[after] >= FAR)
    return inside & far & (np.abs(bearings - bearings[before]) <= GAP) & (np.abs(bearings[after] - bearings) <= GAP)
