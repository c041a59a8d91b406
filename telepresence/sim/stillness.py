"""Whether anything that a sensor measures has moved: what stands still is not measured again."""

from __future__ import annotations

import mujoco
import numpy as np

STILL = 1e-5
"""[m], and of the parts of a quaternion: what has moved by less since it was measured stands still. A hundredth of the
finest step of a distance sensor here."""


class Stillness:
    """Remembers where bodies were. `holds` needs the world's lock.

    Args:
        bodies: Numbers of the one that carries the sensor, and of whatever else may move; repeated as they come.
    """

    def __init__(self, bodies: np.ndarray) -> None:
        self._bodies = np.unique(bodies)
        self._now = np.empty(7 * len(self._bodies))
        self._then = np.full(len(self._now), np.nan)
        places = 3 * len(self._bodies)
        self._places, self._turns = self._now[:places].reshape(-1, 3), self._now[places:].reshape(-1, 4)

    def holds(self, data: mujoco.MjData) -> bool:
        """Return whether nothing has moved since this was last false; it is false at first."""
        data.xpos.take(self._bodies, 0, self._places, "clip")  # without "clip", NumPy would copy once more
        data.xquat.take(self._bodies, 0, self._turns, "clip")
        if np.abs(self._now - self._then).max() < STILL:
            return True
        self._then[:] = self._now
        return False
