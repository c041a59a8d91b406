"""ALListeningMovement: slight movements that show that the robot listens. Source: NAOqi 2.8 documentation,
ALListeningMovement. It listens while somebody has subscribed to ALSpeechRecognition and it does not speak itself.
"""

from __future__ import annotations

import random

from pepper_sim.animations import library
from pepper_sim.animations.accompaniment import Accompaniment
from pepper_sim.naoqi.autonomous_ability import AutonomousAbility
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_speech_recognition import ALSpeechRecognition

PERIOD = 0.5
"""How often it looks whether the robot listens, while it is on [s]."""
_FOLDER = "animations/Stand/BodyTalk/Listening/"


class ALListeningMovement(AutonomousAbility):
    """Movements while listening."""

    name = "ALListeningMovement"

    def __init__(
        self, memory: ALMemory, robot: Pepper, joints: MotionJoints, alarm: Alarm, recognition: ALSpeechRecognition
    ) -> None:
        super().__init__()
        self._memory = memory
        self._alarm = alarm
        self._recognition = recognition
        self._accompaniment = Accompaniment(robot, joints, alarm, "ListeningMovement")
        self._random = random.Random()
        self._looking = False
        self._animations = [path for path in library.paths() if path.startswith(_FOLDER)]

    def close(self) -> None:
        self._enabled = False
        self._accompaniment.close()

    @property
    def running(self) -> bool:
        return self._accompaniment.active

    def changed(self) -> None:
        if self._enabled and not self._looking:
            self._looking = True
            self._look()

    def _look(self) -> None:
        self._looking = self._enabled
        speaking = bool(self._memory.read("ALTextToSpeech/TextStarted"))
        if not (self._looking and self._recognition.active and not speaking):
            self._accompaniment.end()
        elif not self._accompaniment.active:
            self._accompaniment.begin(lambda: self._random.choice(self._animations))
        if self._looking:
            self._alarm.after(PERIOD).add_done_callback(lambda _: self._look())
