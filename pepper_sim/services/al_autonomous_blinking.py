"""ALAutonomousBlinking: the eyes blink while the robot interacts. Source: NAOqi 2.8 documentation,
ALAutonomousBlinking: 1 to 7 s from blink to blink, and none while a call to ALLeds changes the eyes.
"""

from __future__ import annotations

import random

from pepper_sim.naoqi.autonomous_ability import AutonomousAbility
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.services.al_leds import ALLeds
from pepper_sim.services.al_memory import ALMemory

SHORTEST, LONGEST = 1.0, 7.0
"""Time from blink to blink [s]."""
BLINK = 0.15
"""How long the eyes are dark [s]."""


class ALAutonomousBlinking(AutonomousAbility):
    """Blinking of the eyes."""

    name = "ALAutonomousBlinking"

    def __init__(self, memory: ALMemory, leds: ALLeds, alarm: Alarm) -> None:
        super().__init__()
        self._memory = memory
        self._leds = leds
        self._alarm = alarm
        self._random = random.Random()
        self._waiting = False
        self._end = memory.follow("AutonomousLife/State", lambda _: self.changed())

    def close(self) -> None:
        self._end()
        self._enabled = False

    @property
    def running(self) -> bool:
        return self._enabled and self._memory.read("AutonomousLife/State") == "interactive"

    def changed(self) -> None:
        if self.running and not self._waiting:
            self._waiting = True
            self._wait()

    def _wait(self) -> None:
        self._alarm.after(self._random.uniform(SHORTEST, LONGEST)).add_done_callback(lambda _: self._blink())

    def _blink(self) -> None:
        self._waiting = self.running
        if self._waiting:
            self._leds.blink("FaceLeds", BLINK)
            self._wait()
