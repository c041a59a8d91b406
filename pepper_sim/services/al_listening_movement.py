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
from pepper_sim.services.al_autonomous_life import ALAutonomousLife
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_speech_recognition import ALSpeechRecognition

PERIOD = 0.5
"""How often it looks whether the robot listens, while its state of life lets it move [s]."""
_FOLDER = "animations/Stand/BodyTalk/Listening/"


class ALListeningMovement(AutonomousAbility):
    """Movements while listening."""

    name = "ALListeningMovement"
    states = ("solitary", "interactive")

    def __init__(
        self,
        life: ALAutonomousLife,
        memory: ALMemory,
        robot: Pepper,
        joints: MotionJoints,
        alarm: Alarm,
        recognition: ALSpeechRecognition,
    ) -> None:
        super().__init__(life)
        self._memory = memory
        self._alarm = alarm
        self._recognition = recognition
        self._accompaniment = Accompaniment(robot, joints, alarm, "ListeningMovement")
        self._random = random.Random()
        self._looking = False
        self._closed = False
        self._animations = [path for path in library.paths() if path.startswith(_FOLDER)]
        self._end = memory.follow("AutonomousLife/State", lambda _: self.changed())

    def close(self) -> None:
        self._closed = True
        self._end()

    @property
    def running(self) -> bool:
        return self._accompaniment.active

    def changed(self) -> None:
        """Begin to look whether the robot listens, after the switch or the state of life has changed."""
        if self.able and not self._looking:
            self._looking = True
            self._look()

    def _look(self) -> None:
        speaking = bool(self._memory.read("ALTextToSpeech/TextStarted"))
        listening = self.able and self._recognition.active and not speaking and not self._closed
        if listening and not self._accompaniment.active:
            self._accompaniment.begin(lambda: self._random.choice(self._animations))
        elif not listening:
            self._accompaniment.end()
        self._looking = self.able and not self._closed
        if self._looking:
            self._alarm.after(PERIOD).add_done_callback(lambda _: self._look() if not self._closed else None)
