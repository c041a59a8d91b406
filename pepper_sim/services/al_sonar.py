"""ALSonar: events of near obstacles.

The distances are always up to date in ALMemory: on Pepper the collision protection of the base keeps the sonars on.
Left and right in the event names refer to NAO's two sonars; Pepper's front sonar raises both.
"""

from __future__ import annotations

import logging
import threading

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

log = logging.getLogger(__name__)

NEAR = 0.5
"""An obstacle closer than this raises an event [m] (NAOqi 2.8 documentation, sonar)."""
_PERIOD = 0.1


class ALSonar(Extractor):
    """Detects obstacles in front of the robot by ultrasound."""

    name = "ALSonar"
    events = ("SonarLeftDetected", "SonarRightDetected", "SonarLeftNothingDetected", "SonarRightNothingDetected")

    def __init__(self, robot: Pepper, memory: ALMemory) -> None:
        super().__init__(memory)
        self._robot = robot
        self._near: bool | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="sonar-events", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while not self._closing.wait(_PERIOD):
            try:
                if self.active:
                    self._poll(float(self._robot.snapshot().sonar["Front"]))
                else:
                    self._near = None
            except Exception:  # one event that fails must not end all later ones
                log.exception("the sonars' events could not be raised")

    def _poll(self, distance: float) -> None:
        near = distance < NEAR
        if near == self._near:
            return
        self._near = near
        for side in ("Left", "Right"):
            self.memory.announce(f"Sonar{side}{'Detected' if near else 'NothingDetected'}", distance)
