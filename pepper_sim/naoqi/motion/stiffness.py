"""ALMotion: waking up and resting, stiffness.

The stiffness of Pepper's leg follows wakeUp and rest only. `setStiffnesses` on a group that contains the leg applies to
the rest of the group, because documented examples call it with "Body" (NAOqi 2.8, control-stiffness).
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import threading
from collections.abc import Iterator, Sequence
from typing import Any

from pepper_sim.body.description import MOTION_CYCLE
from pepper_sim.body.postures import CROUCH, STAND
from pepper_sim.naoqi.joint_names import BODY, GROUPS, LEG, STIFFNESS, joints_of, per_joint, values_for
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.motion_tasks import MotionTasks
from pepper_sim.naoqi.service import ServiceError, one_of, remote, within
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

_WAKE_SPEED = 0.4
_REST_SPEED = 0.35
_EVENTS = ("wakeUpStarted", "wakeUpFinished", "restStarted", "restFinished")


class MotionStiffness:
    """Stiffness part of ALMotion. `awake` is what robotIsWakeUp answers."""

    def __init__(
        self, robot: Pepper, memory: ALMemory, workers: Workers, tasks: MotionTasks, joints: MotionJoints
    ) -> None:
        self._robot = robot
        self._memory = memory
        self._workers = workers
        self._tasks = tasks
        self._joints = joints
        self._changing = threading.Lock()
        self.awake = True
        memory.declare(("robotIsWakeUp", *(f"ALMotion/Stiffness/{event}" for event in _EVENTS)), "ALMotion")
        memory.store("robotIsWakeUp", True)

    def restart(self) -> None:
        """Stand awake again, because the world was reset."""
        self.awake = True
        self._memory.store("robotIsWakeUp", True)

    @remote("b()")
    def wakeUp(self) -> concurrent.futures.Future:
        """Turns the motors on and, if it rested, stands up; ends when the robot stands.

        To stand up it takes the joints from other motions, as rest does.
        """
        self._require_upright("wakeUp")
        return self._workers.run(self._stiffen if self.awake else self._wake_up)

    @remote("v()")
    def rest(self) -> concurrent.futures.Future:
        """Stops, goes to a safe posture and turns the motors off; ends when they are off.

        Until wakeUp has ended the robot does not drive.
        """
        self._require_upright("rest")
        self._set_awake(False)  # from now on a wakeUp ends the rest
        return self._workers.run(self._rest)

    @remote("v(s)", name="rest")
    def restChain(self, chainName: str) -> None:
        """Turns one arm's motors off ("LArm", "RArm" or "Arms")."""
        one_of(chainName, ("LArm", "RArm", "Arms"), "chainName")
        self._robot.set_stiffness(dict.fromkeys(GROUPS[chainName], 0.0))

    @remote("v(s)", name="wakeUp")
    def wakeUpChain(self, chainName: str) -> None:
        """Turns one arm's motors on ("LArm", "RArm" or "Arms")."""
        one_of(chainName, ("LArm", "RArm", "Arms"), "chainName")
        self._robot.set_stiffness(dict.fromkeys(GROUPS[chainName], 1.0))

    @remote("b()")
    def robotIsWakeUp(self) -> bool:
        """Whether the robot is awake."""
        return self.awake

    @remote("v(mm)")
    def setStiffnesses(self, names: Any, stiffnesses: Any) -> None:
        """Sets stiffness, 0 to 1, at once. One value applies to all joints; the leg is left as it is."""
        self._apply(self._wanted(names, stiffnesses))

    @remote("[f](m)")
    def getStiffnesses(self, jointName: Any) -> list[float]:
        """Returns stiffness per joint."""
        stiffness = self._robot.snapshot().stiffness
        return [float(stiffness[joint]) for joint in joints_of(jointName, "jointName")]

    @remote("v(mmm)")
    def stiffnessInterpolation(self, names: Any, stiffnessLists: Any, timeLists: Any) -> concurrent.futures.Future:
        """Changes stiffness over time [s]; ends when it is reached. Of a list per joint only the last entry counts.

        setStiffnesses ends it.
        """
        joints = joints_of(names)
        targets = self._wanted(names, _last(stiffnessLists, len(joints)))
        times = values_for(joints, per_joint(names, _last(timeLists, len(joints))), "timeLists", spread=True)
        duration = within(max(times.values()), 0.0, 600.0, "timeLists")
        return self._tasks.book(
            "stiffnessInterpolation",
            [STIFFNESS[joint] for joint in joints],
            lambda: self._robot.ramp_stiffness(targets, duration),
        )

    # --- inside ------------------------------------------------------------------------------------------------------

    def _wanted(self, names: Any, stiffnesses: Any) -> dict[str, float]:
        wanted = values_for(joints_of(names), per_joint(names, stiffnesses), "stiffnesses", spread=True)
        for joint, value in wanted.items():
            within(value, 0.0, 1.0, f"stiffnesses of {joint}")
        return {joint: value for joint, value in wanted.items() if joint not in LEG}

    def _apply(self, stiffness: dict[str, float]) -> None:
        if stiffness:
            self._robot.set_stiffness(stiffness)

    @contextlib.contextmanager
    def _whole_body(self, *, sparing: str = "") -> Iterator[None]:
        """Take all joints from whatever uses them or waits for them, an earlier wakeUp or rest included; but wait for
        the motion of the name `sparing`.
        """
        while True:
            self._tasks.end_using((*BODY, *STIFFNESS.values()), sparing=sparing)
            if self._changing.acquire(timeout=MOTION_CYCLE):
                break
        try:
            yield
        finally:
            self._changing.release()

    def _stiffen(self) -> bool:
        self._memory.announce("ALMotion/Stiffness/wakeUpStarted", 1)
        self._robot.set_stiffness(dict.fromkeys(BODY, 1.0))
        self._memory.announce("ALMotion/Stiffness/wakeUpFinished", 1)
        return True

    def _wake_up(self) -> bool:
        with self._whole_body(sparing="wakeUp"):  # one cut short by another one would leave the robot half way up
            if self.awake:  # another one has done it
                return self._stiffen()
            self._memory.announce("ALMotion/Stiffness/wakeUpStarted", 1)
            self._robot.set_stiffness(dict.fromkeys(BODY, 1.0))
            arrived = bool(self._joints.take_posture(STAND, _WAKE_SPEED, "wakeUp").result())
            if arrived:
                self._robot.hold_base("stiffness", False)
                self._set_awake(True)
            self._memory.announce("ALMotion/Stiffness/wakeUpFinished", 1)
            return arrived

    def _rest(self) -> None:
        with self._whole_body(sparing="rest"):  # a rest cut short by another one would end with the motors off, upright
            if not self.awake and not any(self._robot.snapshot().stiffness.values()):
                return
            self._memory.announce("ALMotion/Stiffness/restStarted", 1)
            self._set_awake(False)  # an earlier wakeUp may have come to its end meanwhile
            self._robot.hold_base("stiffness", True)  # from now on nobody drives it on, until it stands again
            self._robot.stop_move().result()
            self._joints.take_posture(CROUCH, _REST_SPEED, "rest").result()
            if self.awake:  # the world was reset in the meantime
                self._robot.hold_base("stiffness", False)
                return
            self._robot.set_stiffness(dict.fromkeys(BODY, 0.0))
            self._memory.announce("ALMotion/Stiffness/restFinished", 1)

    def _set_awake(self, awake: bool) -> None:
        changed, self.awake = self.awake != awake, awake
        if changed:
            self._memory.announce("robotIsWakeUp", awake)

    def _require_upright(self, what: str) -> None:
        if self._robot.snapshot().fallen:
            raise ServiceError(f"{what} is not available: the robot has fallen")


def _last(value: Any, count: int) -> Any:
    """Reduce lists of lists to their last entries; a flat list for one joint to its last entry."""
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        return value
    if any(isinstance(item, list | tuple) and item for item in value):
        return [item[-1] if isinstance(item, list | tuple) and item else item for item in value]
    return value[-1] if count == 1 else value
