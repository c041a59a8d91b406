"""Python's cyclic garbage collection, on Qt's thread only.

Python runs it on whichever thread happens to allocate one object too many, here often one of rospy's. A widget that is
part of a reference cycle would then be destroyed outside Qt's thread, which crashes the program.
"""

from __future__ import annotations

import gc

from PyQt5.QtCore import QObject

from gui.periodic_timer import PeriodicTimer

PERIOD = 2000
"""[ms] between two checks; Python's own thresholds decide whether there is anything to collect."""


class GcOnQtThread(QObject):
    """Collects garbage in place of Python for as long as it lives. To be made and closed on Qt's thread."""

    def __init__(self) -> None:
        super().__init__()
        gc.disable()
        self._timer = PeriodicTimer(PERIOD, self.collect, self)
        self._timer.start()

    def collect(self) -> None:
        """Collect the oldest generation that has reached its threshold, as Python would."""
        counts, thresholds = gc.get_count(), gc.get_threshold()
        for generation in (2, 1, 0):
            if counts[generation] > thresholds[generation]:
                gc.collect(generation)
                return

    def close(self) -> None:
        self._timer.stop()
        gc.enable()
