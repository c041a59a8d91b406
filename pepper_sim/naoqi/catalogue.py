"""Which services a simulated Pepper has, and what each needs."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

import qi

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.body_events import BodyEvents
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.memory_keys import body_keys
from pepper_sim.naoqi.service import Service
from pepper_sim.naoqi.tasks import Alarm, Workers
from pepper_sim.robot import Pepper
from pepper_sim.services.al_animated_speech import ALAnimatedSpeech
from pepper_sim.services.al_animation_player import ALAnimationPlayer
from pepper_sim.services.al_audio_device import ALAudioDevice
from pepper_sim.services.al_audio_player import ALAudioPlayer
from pepper_sim.services.al_audio_recorder import ALAudioRecorder
from pepper_sim.services.al_autonomous_blinking import ALAutonomousBlinking
from pepper_sim.services.al_autonomous_life import ALAutonomousLife
from pepper_sim.services.al_autonomous_moves import ALAutonomousMoves
from pepper_sim.services.al_background_movement import ALBackgroundMovement
from pepper_sim.services.al_basic_awareness import ALBasicAwareness
from pepper_sim.services.al_battery import ALBattery
from pepper_sim.services.al_behavior_manager import DEFAULT_BEHAVIORS, ALBehaviorManager
from pepper_sim.services.al_body_temperature import ALBodyTemperature
from pepper_sim.services.al_chest_button import ALChestButton
from pepper_sim.services.al_dialog import ALDialog
from pepper_sim.services.al_face_characteristics import ALFaceCharacteristics
from pepper_sim.services.al_face_detection import ALFaceDetection
from pepper_sim.services.al_laser import ALLaser
from pepper_sim.services.al_leds import ALLeds
from pepper_sim.services.al_listening_movement import ALListeningMovement
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_motion import ALMotion
from pepper_sim.services.al_navigation import ALNavigation
from pepper_sim.services.al_people_perception import ALPeoplePerception
from pepper_sim.services.al_preference_manager import ALPreferenceManager
from pepper_sim.services.al_robot_model import ALRobotModel
from pepper_sim.services.al_robot_posture import ALRobotPosture
from pepper_sim.services.al_sensors import ALSensors
from pepper_sim.services.al_service_manager import ALServiceManager
from pepper_sim.services.al_sonar import ALSonar
from pepper_sim.services.al_sound_detection import ALSoundDetection
from pepper_sim.services.al_sound_localization import ALSoundLocalization
from pepper_sim.services.al_speaking_movement import ALSpeakingMovement
from pepper_sim.services.al_speech_recognition import ALSpeechRecognition
from pepper_sim.services.al_system import ALSystem
from pepper_sim.services.al_tablet_service import ALTabletService
from pepper_sim.services.al_text_to_speech import ALTextToSpeech
from pepper_sim.services.al_touch import ALTouch
from pepper_sim.services.al_tracker import ALTracker
from pepper_sim.services.al_video_device import ALVideoDevice
from pepper_sim.services.log_manager import LogManager
from pepper_sim.sound.room import Loudspeaker, Room
from pepper_sim.sound.speech import Voice
from pepper_sim.tablet.tablet import Tablet

LAST_SPOKEN = "/home/nao/last_spoken.wav"
"""Where the robot's disk holds what was said last."""


class Catalogue:
    """Builds all services of one robot, in `services`, and ends them.

    `room` is what the robot hears and plays, `disk` its files.
    """

    def __init__(
        self,
        robot: Pepper,
        session: qi.Session,
        tablet: Tablet | None,
        behaviors: Sequence[str] = DEFAULT_BEHAVIORS,
        seed: int = 0,
    ) -> None:
        self.disk = RobotDisk()
        self.room = Room(Loudspeaker(), seed)
        self._workers = Workers()
        self._alarm = Alarm()
        self.clients = ClientServices(session)
        leds = ALLeds(robot, self._alarm)
        body = {**body_keys(robot.JOINTS), **leds.memory_keys()}
        self.memory = ALMemory(robot.snapshot, body, self.clients)
        self.motion = ALMotion(robot, self.memory, self._workers)
        robot.world.on_reset(self.motion.stiffness.restart)
        self._animations = ALAnimationPlayer(robot, self.motion.joints)
        speech = ALTextToSpeech(
            self.memory, Voice(self.room.loudspeaker, self.disk.path(LAST_SPOKEN)), self.disk, self._workers
        )
        self.services: list[Service] = [
            *(self.memory, self.motion, leds, speech),
            ALRobotPosture(robot, self.memory, self._workers, self.motion.joints),
            ALVideoDevice(robot),
            *self._sensors(robot),
            *self._sound(speech),
            *self._life(behaviors),
            *self._perception(robot),
            *self._system(),
        ]
        if tablet is not None:
            self.services.append(ALTabletService(tablet))
        self._events = BodyEvents(robot, self.memory)

    def close(self) -> None:
        """End threads, newest first."""
        with contextlib.ExitStack() as stack:
            closing: list[Any] = [self.disk, self.clients, self._alarm, self._workers, *self.services, self._events]
            for part in closing:
                stack.callback(part.close)

    def _sensors(self, robot: Pepper) -> list[Service]:
        memory = self.memory
        return [
            *(ALSonar(robot, memory), ALLaser(), ALTouch(robot), ALBattery(robot)),
            *(ALBodyTemperature(robot, memory), ALSensors(memory), ALChestButton(memory)),
        ]

    def _sound(self, speech: ALTextToSpeech) -> list[Service]:
        return [
            ALAudioDevice(self.room, self.clients, self._alarm, self.disk),
            ALAudioPlayer(self.room, self.disk, self._alarm),
            ALAudioRecorder(self.room, self.disk),
            ALAnimatedSpeech(speech, self._animations),
            ALSpeechRecognition(self.memory),
            ALSoundDetection(self.memory),
            ALSoundLocalization(self.memory),
            ALDialog(),
        ]

    def _life(self, behaviors: Sequence[str]) -> list[Service]:
        return [
            ALAutonomousLife(self.memory, self.motion.stiffness, behaviors),
            ALBasicAwareness(self.memory),
            *(ALBackgroundMovement(), ALListeningMovement(), ALSpeakingMovement()),
            *(ALAutonomousBlinking(), ALAutonomousMoves()),
            *(ALBehaviorManager(behaviors), self._animations),
        ]

    def _perception(self, robot: Pepper) -> list[Service]:
        memory = self.memory
        return [
            *(ALTracker(robot, memory, self.motion.joints), ALNavigation(self.motion.base)),
            *(ALFaceDetection(memory), ALFaceCharacteristics(memory), ALPeoplePerception(memory)),
        ]

    def _system(self) -> list[Service]:
        return [
            *(ALSystem(self.memory), ALRobotModel(), LogManager()),
            *(ALPreferenceManager(), ALServiceManager(self.clients)),
        ]
