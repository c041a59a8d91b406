"""Movements that accompany something, such as speech: one animation after the other until it is over."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future

from pepper_sim.animations import library
from pepper_sim.animations.generator import leading, way
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.robot import Pepper

_PAUSE = 0.5
"""Pause before the next animation after a command took the joints away [s]."""


class Accompaniment:
    """Plays animations while something goes on, then puts the joints back where they were.

    Every command to one of the joints has precedence.

    Args:
        task: What ALMotion.getTaskList calls it.
    """

    def __init__(self, robot: Pepper, joints: MotionJoints, alarm: Alarm, task: str) -> None:
        self._task = task
        self._robot = robot
        self._joints = joints
        self._alarm = alarm
        self._lock = threading.Lock()
        self._choose: Callable[[], str] | None = None
        self._run = 0
        self._motion: Future | None = None
        self._home: dict[str, float] = {}
        self._moved: set[str] = set()

    @property
    def active(self) -> bool:
        """Whether it plays animations now."""
        return self._choose is not None

    def begin(self, choose: Callable[[], str]) -> None:
        """Start; `choose` names the next animation of the library, on any thread."""
        with self._lock:
            if not self._moved:
                self._home = dict(self._robot.snapshot().joint_setpoints)
            self._run += 1
            self._choose = choose
            run, before = self._run, self._motion
        if before is not None:
            before.cancel()  # the way back of the last time
        self._next(run)

    def end(self) -> None:
        """End and go back; returns at once."""
        with self._lock:
            if self._choose is None:
                return
            self._choose = None
            self._run += 1
            motion, moved = self._motion, set(self._moved)
        if motion is not None:
            motion.cancel()
        if not moved:
            return
        back = self._joints.plan(self._task, moved, lambda start: way(start, self._home, moved), yields=True)
        with self._lock:
            self._motion = back
        back.add_done_callback(self._returned)

    def close(self) -> None:
        """End, and move no more."""
        with self._lock:
            self._choose = None
            self._run += 1
            motion = self._motion
        if motion is not None:
            motion.cancel()

    def _next(self, run: int) -> None:
        with self._lock:
            if run != self._run or self._choose is None:
                return
            choose = self._choose
        curves = library.curves(choose())
        motion = self._joints.plan(self._task, curves, lambda start: leading(curves, start), yields=True)
        with self._lock:
            self._moved |= set(curves)
            self._motion = motion
            over = run != self._run
        if over:
            motion.cancel()
        else:
            motion.add_done_callback(lambda done: self._over(run, done))

    def _over(self, run: int, motion: Future) -> None:
        if not motion.cancelled() and motion.result():
            self._next(run)
        elif run == self._run:
            self._alarm.after(_PAUSE).add_done_callback(lambda _: self._next(run))

    def _returned(self, motion: Future) -> None:
        with self._lock:
            if motion is self._motion and self._choose is None:
                self._motion = None
                self._moved.clear()
