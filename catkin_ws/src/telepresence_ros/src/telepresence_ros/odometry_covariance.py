"""How sure the odometry of a robot on wheels is: the covariances of nav_msgs/Odometry.

Zeros would say that it is exact: a filter such as robot_localization then believes nothing else.
"""

from __future__ import annotations

POSITION_VARIANCE, ANGLE_VARIANCE = 1e-4, 1e-3
"""Variance for a metre driven, roughly [m², rad²]; odometry drifts without bound, this only ranks it below a laser.
Chosen, not measured."""
UNMEASURED = 1e6
"""Variance of what is not measured."""


def covariance(whole: bool = False) -> list[float]:
    """Return the 6x6 matrix, row by row, for x, y, z [m] and rotation about x, y, z [rad].

    Args:
        whole: All six are measured; else only x, y and the rotation about z, as by wheels.
    """
    out_of_plane = (POSITION_VARIANCE, ANGLE_VARIANCE, ANGLE_VARIANCE) if whole else (UNMEASURED,) * 3
    variances = (POSITION_VARIANCE, POSITION_VARIANCE, *out_of_plane, ANGLE_VARIANCE)
    return [variances[i] if i == j else 0.0 for i in range(6) for j in range(6)]
