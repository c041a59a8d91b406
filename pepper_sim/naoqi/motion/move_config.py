"""ALMotion's drive parameters: [[name, value], ...] as clients set and read them.

Figures: NAOqi 2.8 documentation, control-walk.
"""

from __future__ import annotations

from typing import Any

from pepper_sim.body.description import ACC_THETA, ACC_XY, BRAKING, HARD_MAX_THETA, HARD_MAX_XY, MAX_THETA, MAX_XY
from pepper_sim.naoqi.service import ServiceError, finite, shown
from telepresence.sim.base import BaseLimits

PARAMETERS: dict[str, tuple[float, float, float]] = {
    "MaxVelXY": (MAX_XY, 0.1, HARD_MAX_XY),
    "MaxVelTheta": (MAX_THETA, 0.2, HARD_MAX_THETA),
    "MaxAccXY": (ACC_XY, 0.1, BRAKING.xy),
    "MaxAccTheta": (ACC_THETA, 0.1, BRAKING.theta),
    "MaxJerkXY": (1.0, 0.2, 5.0),
    "MaxJerkTheta": (2.0, 0.2, 50.0),
}
"""Name -> (default, least, greatest) [m/s, rad/s, m/s², rad/s², m/s³, rad/s³]. Jerk is accepted and not modelled."""

_COLUMNS = {"Default": 0, "Min": 1, "Max": 2}
_ALIASES = {"MaxVelX": "MaxVelXY", "MaxVelY": "MaxVelXY", "MaxAccX": "MaxAccXY", "MaxAccY": "MaxAccXY"}
_WALKING = {
    *("Frequency", "MaxStepX", "MaxStepY", "MaxStepTheta", "MaxStepFrequency", "StepHeight", "TorsoWx", "TorsoWy"),
    *("LeftMaxStepX", "LeftMaxStepY", "RightMaxStepX", "RightMaxStepY"),
}
"""Parameters of the walking robots, which official examples pass to any robot; ignored."""


def move_config_table(which: str) -> list[list]:
    """Return [[name, value], ...] for "Default", "Min" or "Max"."""
    return [[name, values[_COLUMNS[which]]] for name, values in PARAMETERS.items()]


def configured_limits(config: Any) -> BaseLimits:
    """Return the speed and acceleration limits for one command: the defaults overridden by `config`, clipped.

    Raises:
        ServiceError: Not [[name, value], ...], or an unknown name.
    """
    if config == ():
        return BaseLimits(MAX_XY, MAX_THETA, ACC_XY, ACC_THETA)
    values = {name: default for name, (default, _, _) in PARAMETERS.items()}
    if not isinstance(config, list | tuple):
        raise ServiceError(f"moveConfig must be [[name, value], ...], got {shown(config)}")
    for item in config:
        if not isinstance(item, list | tuple) or len(item) != 2 or not isinstance(item[0], str):
            raise ServiceError(f"moveConfig must be [[name, value], ...], got {shown(item)} in it")
        name = _ALIASES.get(item[0], item[0])
        value = finite(item[1], f"moveConfig {item[0]}")
        if name in PARAMETERS:
            _, least, greatest = PARAMETERS[name]
            values[name] = min(max(value, least), greatest)
        elif name not in _WALKING:
            raise ServiceError(f"moveConfig: unknown parameter '{shown(name)[1:-1]}'; known: {', '.join(PARAMETERS)}")
    return BaseLimits(
        max_xy=values["MaxVelXY"],
        max_theta=values["MaxVelTheta"],
        acc_xy=values["MaxAccXY"],
        acc_theta=values["MaxAccTheta"],
    )
