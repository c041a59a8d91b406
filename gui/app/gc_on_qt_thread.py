"""Python's search for unreachable cycles, on Qt's thread only.

Python runs it on whichever thread happens to make one object too many, here often one of rospy's. A widget that is part
of such a cycle would then be destroyed beside Qt's own thread, which ends the program at best.
"""

from __future__ import annotations

import gc

from PyQt5.QtCore import QObject

from gui.periodic_timer import PeriodicTimer

PERIOD = 2000
"""ms between looks; Python's own thresholds decide whether there is anything to do."""


class GcOnQtThread(QObject):
    """Takes the search over for as long as it lives; made and closed on Qt's thread."""

    def __init__(self) -> None:
        super().__init__()
        gc.disable()
        self._timer = PeriodicTimer(PERIOD, self.collect, self)
        self._timer.start()

    def collect(self) -> None:
        """Look for cycles in the youngest generations that have grown enough, as Python does by itself."""
        counts, thresholds = gc.get_count(), gc.get_threshold()
        for generation in (2, 1, 0):
            if counts[generation] > thresholds[generation]:
                gc.collect(generation)
                return

    def close(self) -> None:
        self._timer.stop()
        gc.enable()
