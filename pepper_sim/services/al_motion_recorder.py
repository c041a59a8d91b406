"""ALMotionRecorder: records poses that a person gives the robot with his hands. Radians and seconds."""

from __future__ import annotations

import threading
from typing import Any

from pepper_sim.body.description import MOTION_CYCLE
from pepper_sim.naoqi.joint_names import joints_of
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, within
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.robot import Pepper

_MAX_POSES = 10_000
_BUMPERS, _CHEST_BUTTON = 1, 2


class ALMotionRecorder(Module):
    """Records joint angles, one recording at a time."""

    name = "ALMotionRecorder"

    def __init__(self, robot: Pepper, joints: MotionJoints, workers: Workers) -> None:
        self._robot = robot
        self._motion = joints
        self._workers = workers
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._ended.set()
        self._joints: list[str] = []
        self._times: list[float] = []
        self._poses: list[list[float]] = []

    @remote("v([s]ibi)")
    def startInteractiveRecording(
        self, jointsToRecord: list[str], nbPoses: int, extensionAllowed: bool, mode: int
    ) -> None:
        """Stores a pose at every press: mode 1 of the left bumper, where the right one makes the joints limp or stiff,
        mode 2 of the chest button. It ends after nbPoses, or with extensionAllowed when it is stopped."""
        one_of(mode, (_BUMPERS, _CHEST_BUTTON), "mode")
        ended = self._begin(jointsToRecord, nbPoses)
        self._workers.run(self._record_presses, mode, self._pressed(mode), 0 if extensionAllowed else nbPoses, ended)

    @remote("v([s]ibf[s]m)")
    def startPeriodicRecording(
        self,
        jointsToRecord: list[str],
        nbPoses: int,
        extensionAllowed: bool,
        timeStep: float,
        jointsToReplay: list[str],
        replayData: Any,
    ) -> None:
        """Stores a pose every timeStep seconds, while other joints replay [[times], [Bezier points]]. It ends after
        nbPoses, or with extensionAllowed when it is stopped."""
        within(timeStep, MOTION_CYCLE, 60.0, "timeStep")
        if jointsToReplay:
            if not isinstance(replayData, list | tuple) or len(replayData) != 2:
                raise ServiceError("replayData must be [[times], [points]], one list per joint in each")
            self._motion.angleInterpolationBezier(jointsToReplay, *replayData)
        ended = self._begin(jointsToRecord, nbPoses)
        self._workers.run(self._record_periodically, timeStep, 0 if extensionAllowed else nbPoses, ended)

    @remote("m()")
    def stopAndGetRecording(self) -> list:
        """Ends the recording; returns [joints, times per joint, angles per joint], as angleInterpolation takes them."""
        with self._lock:
            self._ended.set()
            times = [list(self._times) for _ in self._joints]
            return [list(self._joints), times, [list(row) for row in zip(*self._poses, strict=True)]]

    def close(self) -> None:
        self._ended.set()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _begin(self, names: list[str], poses: int) -> threading.Event:
        joints = joints_of(names, "jointsToRecord")
        within(poses, 1, _MAX_POSES, "nbPoses")
        with self._lock:
            if not self._ended.is_set():
                raise ServiceError("a recording runs already")
            self._ended = threading.Event()
            self._joints, self._times, self._poses = joints, [], []
            return self._ended

    def _store(self, begin: float, wanted: int, ended: threading.Event) -> None:
        snapshot = self._robot.snapshot()
        with self._lock:
            if ended.is_set():
                return
            self._times.append(snapshot.time - begin)
            self._poses.append([float(snapshot.joint_positions[joint]) for joint in self._joints])
            if len(self._poses) >= (wanted or _MAX_POSES):
                ended.set()

    def _record_periodically(self, step: float, wanted: int, ended: threading.Event) -> None:
        begin = self._robot.snapshot().time
        while not ended.wait(step):
            self._store(begin, wanted, ended)

    def _record_presses(self, mode: int, before: tuple[bool, bool], wanted: int, ended: threading.Event) -> None:
        begin = self._robot.snapshot().time
        while not ended.wait(MOTION_CYCLE):
            now = self._pressed(mode)
            stored, switched = (new and not old for new, old in zip(now, before, strict=True))
            if stored:
                self._store(begin, wanted, ended)
            if switched:
                limp = not any(self._robot.snapshot().stiffness[joint] for joint in self._joints)
                self._robot.set_stiffness(dict.fromkeys(self._joints, 1.0 if limp else 0.0))
            before = now

    def _pressed(self, mode: int) -> tuple[bool, bool]:
        """Return what stores a pose and what makes the joints limp or stiff."""
        snapshot = self._robot.snapshot()
        if mode == _CHEST_BUTTON:
            return snapshot.touch["ChestButton"], False
        return snapshot.bumpers["FrontLeft"], snapshot.bumpers["FrontRight"]
