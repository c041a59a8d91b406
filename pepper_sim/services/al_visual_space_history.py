"""ALVisualSpaceHistory: when the head last looked in which direction (NAOqi 2.8 documentation).

The grid covers what the head's joints can reach. A cell is as wide as the camera's field of view divided by the grid's
precision, and counts as seen while its centre is in the picture.
"""

from __future__ import annotations

import threading
import time

import numpy as np

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import remote, within
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

DATA = "VisualSpaceHistory/VisualGrid/Data"
_DEFAULT_PRECISION = 2.0
_HEAD = ("HeadYaw", "HeadPitch")


class ALVisualSpaceHistory(Extractor):
    """Keeps track of where the head has looked."""

    name = "ALVisualSpaceHistory"

    def __init__(self, memory: ALMemory, video: ALVideoDevice, robot: Pepper) -> None:
        super().__init__(memory)
        self._robot = robot
        top = video.settings.cameras[0]
        self._field = np.array((top.fovx, top.fovy))
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._awake = threading.Event()
        self._ending = False
        self._precision = _DEFAULT_PRECISION
        memory.declare((DATA,), self.name)
        self.resetGrid()

    @remote("f()")
    def getGridPrecision(self) -> float:
        """Returns the precision: the camera's field of view divided by a cell's."""
        return self._precision

    @remote("v(f)")
    def setGridPrecision(self, resolution: float) -> None:
        """Sets the precision, 1 to 10, and resets the grid."""
        self._precision = within(resolution, 1.0, 10.0, "resolution")
        self.resetGrid()

    @remote("v()")
    def resetGrid(self) -> None:
        """Fills the grid with the present time."""
        cell = self._field / self._precision
        limits = [self._robot.LIMITS[joint] for joint in _HEAD]
        axes = [
            np.arange(limit.lower, limit.upper, size) + size / 2.0 for limit, size in zip(limits, cell, strict=True)
        ]
        with self._lock:
            self._cells = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2) + cell / 2.0
            self._stamps = np.full(len(self._cells), time.time())

    def subscribers_changed(self) -> None:
        with self._lock:
            if self.active and self._thread is None and not self._ending:
                self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
                self._thread.start()
            self._awake.set()

    def close(self) -> None:
        with self._lock:
            self._ending = True
            thread = self._thread
            self._awake.set()
        if thread is not None:
            thread.join(timeout=1.0)
        super().close()

    def _run(self) -> None:
        while True:
            with self._lock:
                self._awake.clear()
                if not self.active or self._ending:
                    self._thread = None
                    return
                data = self._updated()
            self.memory.store(DATA, data)
            self._awake.wait(self.getCurrentPeriod() / 1000.0)

    def _updated(self) -> list:
        """Mark the cells in view, and return all of them, those seen longest ago first."""
        angles = self._robot.snapshot().joint_positions
        seen = np.abs(self._cells - [angles[joint] for joint in _HEAD]) <= self._field / 2.0
        self._stamps[seen.all(axis=1)] = time.time()
        order = np.argsort(self._stamps, kind="stable")
        return [[self._cells[i].tolist(), split_stamp(float(self._stamps[i]))] for i in order]
