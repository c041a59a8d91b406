"""Attention: whom the robot looks at, and what distracts it. The engine of ALBasicAwareness.

Source: NAOqi 2.8 documentation, page albasicawareness.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pepper_sim.naoqi.people.aim import HEAD, head_angles, turn_head
from pepper_sim.naoqi.people.following_base import FollowingBase
from pepper_sim.naoqi.people.population import Known, Look, Population
from pepper_sim.robot import Pepper
from pepper_sim.services.al_motion import ALMotion

NOBODY = -1
LOST_AFTER = 2.0
"""Who is not seen for this long is no longer tracked [s]."""
HEAD_VELOCITY = 1.5
"""The head follows people no faster than this [rad/s]."""
UPWARDS = -0.35
"""How far the head looks up for whoever touches the robot [rad]."""
CLOSER = 0.5
"""Somebody nearer than the tracked person by this distracts a robot that is not engaged [m]."""
_TURN, _TURNING, _TURNED = 1.0, math.radians(20.0), math.radians(3.0)
_NEAR, _FAR, _STEP = 0.6, 1.3, 0.15


@dataclass
class Stimulus:
    """Something to look at: angles of the head, and until when [s, simulation] somebody is searched for there."""

    angles: Mapping[str, float]
    before: Mapping[str, float]
    until: float
    found: int = NOBODY
    over: bool = False


class Attention:
    """Looks at people for one robot. `tracked` is the ID of the person, -1 for nobody."""

    def __init__(
        self, robot: Pepper, motion: ALMotion, population: Population, announce: Callable[[str, Any], None]
    ) -> None:
        self._robot = robot
        self._motion = motion
        self._population = population
        self._announce = announce
        self._stimulus: Stimulus | None = None
        self._base = FollowingBase(robot, motion)
        self.lock = threading.RLock()
        """Held while a look is acted on."""
        self.tracked = NOBODY
        self.engagement, self.tracking = "Unengaged", "Head"

    def release(self) -> None:
        """Track nobody and move nothing."""
        with self.lock:
            self._stimulus = None
            self.halt()
            self._track(NOBODY)

    def halt(self) -> None:
        """Stop the base, if it turns or drives after a person."""
        self._base.halt()

    def track(self, number: int) -> bool:
        """Track a person from now on; false if nobody of this ID is seen."""
        known = self._population.find(number)
        if known is None or not known.visible:
            return False
        self._track(number)
        return True

    def listens(self) -> bool:
        """Whether stimuli count: a fully engaged robot has eyes for nobody else."""
        return self.engagement != "FullyEngaged" or self.tracked == NOBODY

    def look_for(self, angles: Mapping[str, float], seconds: float) -> Stimulus:
        """Look in a direction and search for somebody there."""
        now = self._robot.snapshot().joint_setpoints
        before = {joint: float(now[joint]) for joint in HEAD}
        self._stimulus = Stimulus(angles, before, self._robot.world.time + seconds)
        return self._stimulus

    def update(self, look: Look, *, people: bool, look_speed: float, back_speed: float) -> None:
        """Act on what was just seen. `people`: whether a person by itself is a stimulus; speeds are fractions."""
        limit = self._robot.LIMITS["HeadYaw"].velocity
        stimulus = self._stimulus
        if stimulus is not None:
            self.halt()
            self._search(stimulus, look, look_speed * limit, back_speed * limit)
            return
        tracked = next((known for known in look.known if known.number == self.tracked), None)
        if self.tracked != NOBODY and (tracked is None or look.sight.time - tracked.seen > LOST_AFTER):
            self.halt()
            self._track(NOBODY)
            self._announce("HumanLost", [])
            tracked = None
        if people and look.visible:
            nearest = look.visible[0]
            if tracked is None:
                self._announce("StimulusDetected", "People")
                self._track(nearest.number)
                tracked = nearest
            elif self.engagement == "Unengaged" and nearest.last.distance + CLOSER < tracked.last.distance:
                self._track(nearest.number)
                tracked = nearest
        if tracked is not None and tracked.visible:
            self._follow(tracked)
        else:
            self.halt()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _track(self, number: int) -> None:
        if number != self.tracked:
            self.tracked = number
            self._announce("HumanTracked", number)

    def _search(self, stimulus: Stimulus, look: Look, speed: float, back: float) -> None:
        if look.sight.time >= stimulus.until:
            self._stimulus = None
            if look.visible:
                stimulus.found = min(look.visible, key=lambda known: abs(known.last.angles[0])).number
                if self.engagement == "Unengaged" or self.tracked == NOBODY:
                    self._track(stimulus.found)
            elif self.tracked == NOBODY:
                turn_head(self._robot, self._motion, stimulus.before, back)
            stimulus.over = True
            return
        turn_head(self._robot, self._motion, stimulus.angles, speed)

    def _follow(self, known: Known) -> None:
        angles = head_angles(self._robot, known.last.in_world)
        turn_head(self._robot, self._motion, angles, HEAD_VELOCITY)
        if self.tracking in ("BodyRotation", "MoveContextually"):
            self._turn_base(known)
        else:
            self.halt()  # it may have been told so while the base turned

    def _turn_base(self, known: Known) -> None:
        """Turn the base after the head, and step nearer or away; not while somebody else drives."""
        if not self._base.free:
            return
        x, y, _ = known.last.in_robot
        bearing, distance = math.atan2(y, x), math.hypot(x, y)
        speed = 0.0
        if self.tracking == "MoveContextually":
            speed = _STEP if distance > _FAR else -_STEP if distance < _NEAR else 0.0
        least = _TURNED if self._base.driving else _TURNING
        turn = _TURN * bearing if abs(bearing) > least else 0.0
        if speed or turn:
            limit = self._robot.base_limits.max_theta
            self._base.drive(speed if abs(bearing) < _TURNING else 0.0, max(-limit, min(limit, turn)))
        else:
            self.halt()
