"""Pepper's named postures: joint angles [rad], hands as a fraction (0 closed, 1 open).

Source: recorded values in softbankrobotics-research/qibullet 1.4.6, `robot_posture.py`; names from the ALRobotPosture
page of the NAOqi 2.8 documentation.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from pepper_sim.body.description import JOINTS


def _posture(*angles: float) -> Mapping[str, float]:
    return MappingProxyType(dict(zip(JOINTS, angles, strict=True)))


STAND = _posture(
    *(-0.0077, -0.2117),
    *(1.5800, 0.1166, -1.2180, -0.5185, -0.0307, 0.5896),
    *(-0.0046, -0.0261, 0.0),
    *(1.5800, -0.1150, 1.2257, 0.5185, 0.0276, 0.5888),
)
STAND_ZERO = _posture(
    *(0.0092, 0.0276),
    *(0.0245, 0.0307, -0.0291, -0.0476, 0.0153, 0.0272),
    *(-0.0015, -0.0123, -0.0153),
    *(0.0476, -0.0353, 0.0153, 0.0383, -0.0138, 0.0272),
)
CROUCH = _posture(
    *(0.0, 0.6370),
    *(1.1152, 0.0430, -0.4893, -0.0087, -0.7808, 0.5949),
    *(-0.0031, -1.0385, 0.5139),
    *(1.1029, -0.0184, 0.4909, 0.0087, 0.7869, 0.5967),
)

POSTURES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {"Stand": STAND, "StandInit": STAND, "StandZero": STAND_ZERO, "Crouch": CROUCH}
)
"""Posture name -> joint -> angle. On Pepper Stand and StandInit are the same."""
