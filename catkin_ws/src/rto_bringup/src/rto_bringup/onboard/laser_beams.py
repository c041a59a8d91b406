"""A scan of the robot's laser as the beams that the gate's profile has: their order, from the robot's middle."""

from __future__ import annotations

import numpy as np
from rto_node.client import Scan
from rto_node.robot_facts import LASER_MOUNT

from telepresence.safety import ROBOTINO_LASER, UNKNOWN

LASER = ROBOTINO_LASER.source("laser")


def ranges_of_beams(scan: Scan, mount: float = LASER_MOUNT) -> list[float]:
    """The nearest return in the sector of each of the gate's beams, in their order.

    Args:
        scan: Range 0 is no return (a real robot's scan0).
        mount: Of the scanner, ahead of the middle [m].
    Returns:
        [m] from the robot's middle; the scanner's reach where a ray passed and hit nothing, `UNKNOWN` where none
        points: the scanners that robots have been seen with look 110 degrees to either side.
    """
    ranges = np.array(scan.ranges, float)
    bearings = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    returned = (ranges > scan.range_min) & (ranges < scan.range_max)
    reach = np.where(returned, ranges, scan.range_max)
    x, y = mount + reach * np.cos(bearings), reach * np.sin(bearings)
    rays = np.stack([x, y], axis=1)
    found = np.full(LASER.beams, np.inf)
    # The beam whose direction is nearest is the one with the largest projection.
    np.minimum.at(found, (rays @ LASER.directions.T).argmax(axis=1), np.hypot(x, y))
    return np.where(np.isfinite(found), found, UNKNOWN).tolist()
