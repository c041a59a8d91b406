"""What a behaviour without scripts acts on: the joints of the robot itself."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from pepper_sim.animations.behavior import Box
from pepper_sim.animations.flow import Script
from pepper_sim.animations.timeline import Timeline
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.service import ServiceError
from pepper_sim.naoqi.tasks import Alarm


class JointStage:
    """Plays timelines with the robot's joints."""

    def __init__(self, joints: MotionJoints, alarm: Alarm) -> None:
        self._joints = joints
        self._alarm = alarm

    def play(self, timeline: Timeline) -> Future:
        """Start a timeline; see `Stage`. One without curves only takes its time."""
        if not timeline.curves:
            return self._alarm.after(timeline.duration)
        return self._joints.plan("timeline", timeline.curves, timeline.knots)

    def load(self, box: Box, emit: Callable[[str, Any], None]) -> Script:
        """Scripts run in a process of their own, see `behavior_process`."""
        raise ServiceError(f"the box '{box.name[:60]}' has a script")
