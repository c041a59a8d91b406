"""Whether anything that a sensor measures has moved: what stands still is not measured again."""

from __future__ import annotations

import math

import mujoco
import numpy as np

STILL = 1e-5
"""[m], and of the parts of a quaternion: what has moved by less since it was measured stands still. A hundredth of the
finest step of a distance sensor here."""


class Stillness:
    """Remembers where bodies were. `holds` needs the world's lock.

    Args:
        carrier: Number of the body that carries the sensor.
        others: Of those that may move into its view; repeated as they come.
    """

    def __init__(self, carrier: int, others: np.ndarray) -> None:
        self._carrier, self._others = carrier, np.unique(others)
        self._carried = [math.nan] * 7
        self._now = np.empty(7 * len(self._others))
        self._then = np.full(len(self._now), np.nan)
        places = 3 * len(self._others)
        self._places, self._turns = self._now[:places].reshape(-1, 3), self._now[places:].reshape(-1, 4)

    def holds(self, data: mujoco.MjData) -> bool:
        """Return whether nothing has moved since this was last false; it is false at first, and once more when a
        carrier that moved has come to rest."""
        # Of a robot that drives nothing else needs to be looked at, and for one body NumPy takes longer than Python.
        carried = data.xpos[self._carrier].tolist() + data.xquat[self._carrier].tolist()
        if not all(abs(now - then) < STILL for now, then in zip(carried, self._carried, strict=True)):
            self._carried = carried
            self._then[:1] = math.nan
            return False
        if not len(self._others):
            return True
        data.xpos.take(self._others, 0, self._places, "clip")  # without "clip", NumPy would copy once more
        data.xquat.take(self._others, 0, self._turns, "clip")
        if np.abs(self._now - self._then).max() < STILL:
            return True
        self._then[:] = self._now
        return False
