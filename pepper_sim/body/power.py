"""Battery and motor temperatures: slow models, updated once a second of simulation time.

Neither is published for Pepper in detail; the constants are chosen so that a day looks realistic: about twelve hours on
one charge when standing, and a motor at its continuous torque settles 40 K above room temperature.
"""

from __future__ import annotations

import numpy as np

from pepper_sim.body.description import BATTERY_ENERGY, BATTERY_VOLTAGE, CONTINUOUS_TORQUE, JOINTS
from pepper_sim.body.state import Battery

PERIOD = 1.0
IDLE_POWER = 55.0
"""Computers, tablet, fans, sensors [W]."""
STIFF_POWER = 10.0
"""Motor controllers of a fully stiff body [W]."""
DRIVE_POWER = 120.0
"""Power per m/s of base speed [W s/m]."""
HOLD_POWER = 6.0
"""Power of one motor that holds its continuous torque [W]."""
CHARGER_POWER = 29.2 * 8.0
"""Power that the charging station and the cable deliver [W] (page battery_pep)."""
FULL_CHARGE = 0.95
"""Charge at the start."""

ROOM = 25.0
ELECTRONICS_RISE = 5.0
TORQUE_RISE = 40.0
TIME_CONSTANT = 600.0
"""Room temperature [°C], rises [K], and how fast a motor warms up [s]."""

_CONTINUOUS = np.array([CONTINUOUS_TORQUE[joint] for joint in JOINTS])


class Power:
    """State of the battery and temperatures of the motors [°C]."""

    def __init__(self) -> None:
        self.temperatures = np.full(len(JOINTS), ROOM + ELECTRONICS_RISE)
        self._charge = FULL_CHARGE
        self._power = IDLE_POWER
        self._plugged = False

    @property
    def battery(self) -> Battery:
        return Battery(self._charge, -self._power / BATTERY_VOLTAGE, self._plugged)

    def update(
        self, dt: float, torques: np.ndarray, stiffness: np.ndarray, speed: float, *, plugged: bool = False
    ) -> None:
        """Advance by `dt` seconds with the given joint torques [N m], stiffness (0...1) and base speed [m/s]."""
        load = (torques / _CONTINUOUS) ** 2
        self._power = (
            IDLE_POWER + STIFF_POWER * float(stiffness.mean()) + DRIVE_POWER * speed + HOLD_POWER * float(load.sum())
        )
        self._plugged = plugged
        if plugged and self._charge < 1.0:
            self._power -= CHARGER_POWER
        elif plugged:
            self._power = 0.0
        self._charge = min(1.0, max(0.0, self._charge - self._power * dt / BATTERY_ENERGY))
        goal = ROOM + ELECTRONICS_RISE + TORQUE_RISE * load
        self.temperatures += (goal - self.temperatures) * min(1.0, dt / TIME_CONSTANT)
