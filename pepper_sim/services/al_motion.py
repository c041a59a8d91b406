"""ALMotion: everything that moves. Its methods are in the files of `pepper_sim.naoqi.motion`."""

from __future__ import annotations

import concurrent.futures
from typing import Any

from pepper_sim.body.postures import STAND
from pepper_sim.naoqi.motion.base import MotionBase
from pepper_sim.naoqi.motion.config import MotionConfig
from pepper_sim.naoqi.motion.frames import MotionFrames
from pepper_sim.naoqi.motion.idle import MotionIdle
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.motion.reflexes import MotionReflexes
from pepper_sim.naoqi.motion.stiffness import MotionStiffness
from pepper_sim.naoqi.motion.two_legged import MotionOfTwoLegs
from pepper_sim.naoqi.motion_tasks import MotionTasks
from pepper_sim.naoqi.service import Module, remote
from pepper_sim.naoqi.tasks import Alarm, Watch, Workers
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

_INIT_SPEED = 0.4


class ALMotion(Module):
    """Moves the robot: base, joints, stiffness."""

    name = "ALMotion"

    def __init__(self, robot: Pepper, memory: ALMemory, watch: Watch, alarm: Alarm) -> None:
        self._robot = robot
        self.tasks = MotionTasks()
        self.base = MotionBase(robot, watch, self.tasks)
        self.joints = MotionJoints(robot, self.tasks)
        self._workers = Workers()  # of its own: rest must not wait because calls of other services do
        self.stiffness = MotionStiffness(robot, memory, self._workers, self.tasks, self.joints)
        self._idle = MotionIdle(robot, self.joints, alarm)
        self._others = (
            MotionFrames(robot),
            MotionConfig(robot, self.tasks),
            MotionReflexes(robot, memory),
            self._idle,
            MotionOfTwoLegs(),
        )

    def parts(self) -> tuple[Any, ...]:
        return (self, self.base, self.joints, self.stiffness, *self._others)

    def restart(self) -> None:
        """Stand awake again and forget what waits for its turn, because the world was reset; its lock is held."""
        self.stiffness.restart()
        self._robot.world.post(self.tasks.drop_waiting())

    def close(self) -> None:
        self._idle.close()
        self.tasks.close()
        self._workers.close()

    @remote("v()")
    def moveInit(self) -> concurrent.futures.Future:
        """Goes to the posture from which the robot drives; ends when it has been reached."""
        return self.joints.go(STAND, _INIT_SPEED, "moveInit")

    @remote("v()")
    def walkInit(self) -> concurrent.futures.Future:
        """Old name of moveInit."""
        return self.moveInit()
