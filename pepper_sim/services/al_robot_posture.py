"""ALRobotPosture: named postures. Names: NAOqi 2.8 documentation, postures_pep."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Mapping

from pepper_sim.body.joints import resolve
from pepper_sim.body.postures import POSTURES
from pepper_sim.naoqi.joint_names import HANDS
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.service import Module, one_of, remote, within
from pepper_sim.naoqi.tasks import Watch
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

FAMILIES = {"Stand": "Standing", "StandInit": "Standing", "StandZero": "Standing", "Crouch": "Crouching"}
_TOLERANCE = 0.15
"""A posture is recognised, and counts as reached, when every joint but the hands is within this angle [rad]."""
_SPEED_SHARE = 0.4
"""Fraction of the joints' top speed at goToPosture's speed 1: fast, but the robot does not tip over."""
_MAX_TRIES = 10
_SETTLING = 0.5
"""How long after its motion the robot may take to have the posture [s]."""


class ALRobotPosture(Module):
    """Goes to named postures and recognises them."""

    name = "ALRobotPosture"

    def __init__(self, robot: Pepper, memory: ALMemory, watch: Watch, joints: MotionJoints) -> None:
        self._robot = robot
        self._watch = watch
        self._joints = joints
        self._tries = 3
        self._stops = 0
        self._motions: set[concurrent.futures.Future] = set()
        memory.declare(("PostureChanged", "PostureFamilyChanged"), self.name)

    @remote("[s]()")
    def getPostureList(self) -> list[str]:
        """Lists the postures."""
        return list(POSTURES)

    @remote("[s]()")
    def getPostureFamilyList(self) -> list[str]:
        """Lists the families of postures."""
        return sorted(set(FAMILIES.values()))

    @remote("s()")
    def getPosture(self) -> str:
        """Returns the posture of the robot, or "Unknown"."""
        return recognise(self._robot.snapshot().joint_positions)

    @remote("s()")
    def getPostureFamily(self) -> str:
        """Returns the family of the robot's posture, or "Unknown"."""
        return FAMILIES.get(self.getPosture(), "Unknown")

    @remote("b(sf)")
    def goToPosture(self, postureName: str, speed: float) -> concurrent.futures.Future:
        """Goes to a posture at a relative speed (0 to 1); true when the robot has it, after up to three tries.

        It waits while other motions use the joints.
        """
        one_of(postureName, POSTURES, "postureName")
        _check_speed(speed)
        return self._go(postureName, speed, self._tries)

    @remote("b(sf)")
    def applyPosture(self, postureName: str, speed: float) -> concurrent.futures.Future:
        """Moves the joints to a posture once; true when the robot has it."""
        one_of(postureName, POSTURES, "postureName")
        _check_speed(speed)
        return self._go(postureName, speed, 1)

    @remote("v()")
    def stopMove(self) -> None:
        """Ends goToPosture and applyPosture."""
        self._stops += 1
        for motion in tuple(self._motions):
            motion.cancel()

    @remote("v(i)")
    def setMaxTryNumber(self, pMaxTryNumber: int) -> None:
        """Sets how often goToPosture tries."""
        self._tries = int(within(pMaxTryNumber, 1, _MAX_TRIES, "pMaxTryNumber"))

    def _go(self, name: str, speed: float, tries: int) -> concurrent.futures.Future:
        answer: concurrent.futures.Future = concurrent.futures.Future()
        stops = self._stops

        def attempt(left: int) -> None:
            motion = self._joints.go(POSTURES[name], speed * _SPEED_SHARE, "goToPosture")
            self._motions.add(motion)
            answer.add_done_callback(lambda done: motion.cancel() if done.cancelled() else None)
            motion.add_done_callback(lambda done: moved(done, left))
            if self._stops != stops:  # stopMove came before the motion was in the set
                motion.cancel()

        def moved(motion: concurrent.futures.Future, left: int) -> None:
            self._motions.discard(motion)
            if motion.cancelled() or not motion.result():
                resolve(answer, False)  # another command took a joint
            else:
                settled = self._watch.until(
                    lambda: has_posture(self._robot.snapshot().joint_positions, POSTURES[name]), _SETTLING
                )
                settled.add_done_callback(lambda done: checked(done.result(), left - 1))

        def checked(reached: bool, left: int) -> None:
            able = all(self._robot.snapshot().stiffness[joint] for joint in POSTURES[name])
            if reached or not left or not able or self._stops != stops:
                resolve(answer, reached)
            else:
                attempt(left)

        attempt(tries)
        return answer


def has_posture(angles: Mapping[str, float], posture: Mapping[str, float]) -> bool:
    """Whether all joints but the hands have the posture's angles."""
    return all(abs(angles[joint] - angle) <= _TOLERANCE for joint, angle in posture.items() if joint not in HANDS)


def recognise(angles: Mapping[str, float]) -> str:
    """Return the first posture that has these joint angles, or "Unknown"."""
    return next((name for name, posture in POSTURES.items() if has_posture(angles, posture)), "Unknown")


def _check_speed(speed: float) -> None:
    within(speed, 0.01, 1.0, "speed")
