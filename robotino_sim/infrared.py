"""Infrared distance sensors: distance -> voltage of the sensor -> the distance that Robotino's software makes of it.

The two tables are not each other's inverse; going through both gives the real readings' error of one to two
centimetres, the ceiling of 0.41 m ("nothing there") and the floor of 0.04 m. Closer than 3 cm the sensor's voltage
falls again, so that an obstacle at the bumper reads as farther away than it is.

Sources: volts to metres, Robotino's api2 DistanceSensorImpl.hpp (mirror BusHero/robotino_api2); metres to volts, the
Sharp sensors' tables of cyberbotics/webots, projects/devices/sharp/protos, GP2Y0A41SK0F from 3 cm on and GP2D120 below,
likewise the noise and, in Robotino3.proto, the mounting.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from robotino_sim.controller import CYCLE
from telepresence.sim.rays import Rays
from telepresence.sim.stillness import Stillness

COUNT = 9
"""Sensor i points at i times 40 degrees counter-clockwise, sensor 0 straight ahead (api2 DistanceSensorArrayImpl)."""
MOUNTING_RADIUS, MOUNTING_HEIGHT = 0.2264, 0.0566
"""Where a sensor's distance begins [m]."""
NOTHING, NEAREST = 0.41, 0.04
"""Largest and smallest reading [m]."""
PERIOD = CYCLE
"""The controller publishes voltages in every cycle of its loop [s]."""
NOISE = 0.005
"""Standard deviation of the voltage, relative."""
ADC_STEP = 5.0 / 4096
"""[V]"""

RAY_START = 0.02
"""Rays start this far inside the robot's outline [m]: a ray that starts inside a touching obstacle would miss it."""
_BEAM_HALF_ANGLE = math.radians(2.0)
"""The light spot is a few centimetres wide at 0.3 m; no source gives a figure."""
_SENSOR: tuple[tuple[float, float], ...] = (  # metres, volts
    *((0.0, 1.37), (0.004, 1.37), (0.010, 1.85), (0.020, 2.21), (0.024, 2.73), (0.03, 3.03), (0.035, 2.78)),
    *((0.04, 2.72), (0.05, 2.33), (0.06, 2.01), (0.07, 1.76), (0.08, 1.55), (0.09, 1.40), (0.10, 1.25)),
    *((0.12, 1.04), (0.14, 0.92), (0.16, 0.82), (0.18, 0.73), (0.20, 0.66), (0.25, 0.53), (0.30, 0.42)),
    *((0.35, 0.37), (0.40, 0.31)),
)
_BRIGHTNESS = np.array([1.0, 0.15, 0.15, 0.15, 0.15])
"""Brightness of the beam's middle and of its edge, left, right, above, below."""
_DARK = 0.40 + 0.31 * (0.40 - 0.35) / (0.37 - 0.31)
"""Where the continued table reaches zero volts [m]."""
_SOFTWARE: tuple[tuple[float, float], ...] = (  # volts, metres
    *((0.30, 0.41), (0.39, 0.35), (0.41, 0.30), (0.50, 0.25), (0.75, 0.18), (0.80, 0.16), (0.95, 0.14), (1.05, 0.12)),
    *((1.30, 0.10), (1.40, 0.09), (1.55, 0.08), (1.80, 0.07), (2.35, 0.05), (2.55, 0.04)),
)


def voltage(distance: np.ndarray | float) -> np.ndarray:
    """Return a sensor's output [V] for an obstacle at `distance` [m]; infinity is no obstacle.

    Linear between the table's points, and beyond the last one as steep as before it, down to zero."""
    metres, volts = np.array([*_SENSOR, (_DARK, 0.0)]).T
    return np.interp(distance, metres, volts)


def reading(volts: np.ndarray | float) -> np.ndarray:
    """Return the distance [m] that Robotino reports for a voltage [V]: 0.04 to 0.41, never anything else."""
    table_volts, metres = np.array(_SOFTWARE).T
    return np.interp(volts, table_volts, metres)


class InfraredRing:
    """The nine sensors of one robot. `measure` needs the world's lock.

    The model has a site `infrared_0` ... `infrared_8` at each sensor, x outward.

    Args:
        rng: Draws the noise; None for none.
    """

    def __init__(self, model: mujoco.MjModel, prefix: str, rng: np.random.Generator | None = None) -> None:
        self._rng = rng
        beams = [(f"{prefix}infrared_{i}", _beam()) for i in range(COUNT)]
        self._beams = Rays(model, beams, _DARK + RAY_START, all_around=True)
        self._rest = Stillness(self._beams.body, self._beams.others)
        self._volts: np.ndarray = np.zeros(COUNT)

    def measure(self, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """Return voltages [V] as digitised and readings [m], shape (9,) each."""
        if not self._rest.holds(data):
            distances = self._beams.cast(data).reshape(COUNT, -1) - RAY_START
            self._volts = voltage(spot_distance(np.maximum(distances, 0.0)))
        volts = self._volts
        if self._rng is not None:
            volts = volts * (1.0 + NOISE * self._rng.standard_normal(COUNT))
        volts = np.round(volts / ADC_STEP) * ADC_STEP
        return volts, reading(volts)


def spot_distance(distances: np.ndarray) -> np.ndarray:
    """Return where sensors see their light spot (n,) [m] when a beam's five rays hit several distances (n, 5) [m].

    The sensor goes by where most of the reflected light comes from; the beam's middle is brightest, and near surfaces
    send more of it back: the median, weighted with brightness over distance squared. On any one surface that is the
    middle; a thin leg at the beam's edge counts before an empty room, and before a wall if it is much nearer."""
    with np.errstate(divide="ignore"):
        weights = _BRIGHTNESS / np.maximum(distances, 0.01) ** 2
    order = np.argsort(distances, axis=1)
    gathered = np.cumsum(np.take_along_axis(weights, order, axis=1), axis=1)
    middle = np.argmax(gathered >= 0.5 * gathered[:, -1:], axis=1)
    chosen = np.take_along_axis(order, middle[:, None], axis=1)
    return np.take_along_axis(distances, chosen, axis=1)[:, 0]


def _beam() -> np.ndarray:
    """Return the beam's middle and four rays around it; unit vectors, shape (5, 3)."""
    c, s = math.cos(_BEAM_HALF_ANGLE), math.sin(_BEAM_HALF_ANGLE)
    return np.array([(1.0, 0.0, 0.0), (c, s, 0.0), (c, -s, 0.0), (c, 0.0, s), (c, 0.0, -s)])
