"""ALBasicAwareness: attention to people, touches, noises and movements.

While it runs, the head follows a person whom the robot sees, as `pepper_sim.naoqi.people.attention` says. A motion that
uses the head pauses it. Source: NAOqi 2.8 documentation, ALBasicAwareness.
"""

from __future__ import annotations

import concurrent.futures
import math
from typing import Any

from pepper_sim.naoqi.people.aim import HEAD, head_angles
from pepper_sim.naoqi.people.attention import NOBODY, UPWARDS, Attention
from pepper_sim.naoqi.people.population import Look, Population
from pepper_sim.naoqi.service import Module, ServiceError, finite, one_of, remote, shown
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_motion import ALMotion

ENGAGEMENT_MODES = ("Unengaged", "FullyEngaged", "SemiEngaged")
TRACKING_MODES = ("Head", "BodyRotation", "WholeBody", "MoveContextually")
STIMULI = ("People", "Touch", "TabletTouch", "Sound", "Movement", "NavigationMotion")
_STIMULI_AT_START = {name: name != "NavigationMotion" for name in STIMULI}
_DEFAULTS: dict[str, Any] = {
    "LookStimulusSpeed": 0.5,
    "LookBackSpeed": 0.3,
    "NobodyFoundTimeOut": 2.0,
    "MinTimeTracking": 5.0,
    "TimeSleepBeforeResumeMS": 0,
    "TimeOutResetHead": 10.0,
    "AmplitudeYawTracking": 120.0,
    "FramerateTracking": 15,
    "PeoplePerceptionPeriod": 70,
    "SlowPeoplePerceptionPeriod": 200,
    "HeadThreshold": 5.0,
    "BodyRotationThreshold": 20.0,
    "BodyRotationThresholdNav": 20.0,
    "MaxDistanceFullyEngaged": 1.5,
    "MaxDistanceNotFullyEngaged": 3.5,
    "MaxHumanSearchTime": 0.5,
    "ServoingFrequency": 10.0,
}
"""Names and values of the NAOqi 2.5 and 2.8 documentation, ALBasicAwareness. 2.8 has the two speeds only."""
_SPEEDS = ("LookStimulusSpeed", "LookBackSpeed")
_SEARCH_PATIENCE = 1.5


class ALBasicAwareness(Module):
    """Pays attention to people."""

    name = "ALBasicAwareness"

    def __init__(
        self, robot: Pepper, memory: ALMemory, motion: ALMotion, population: Population, workers: Workers
    ) -> None:
        self._robot = robot
        self._memory = memory
        self._motion = motion
        self._workers = workers
        self._enabled = self._paused = False
        self._stimuli = dict(_STIMULI_AT_START)
        self._parameters = dict(_DEFAULTS)
        self.attention = Attention(robot, motion, population, self._announce)
        memory.declare(
            (
                f"ALBasicAwareness/{event}"
                for event in ("HumanTracked", "HumanLost", "StimulusDetected", "PauseStateChanged")
            ),
            self.name,
        )
        memory.store("ALBasicAwareness/HumanTracked", NOBODY)
        memory.follow("TouchChanged", self._touched)
        memory.follow("ALSoundLocalization/SoundLocated", self._heard)
        memory.follow("MovementDetection/MovementDetected", lambda _: self._distract("Movement", None))
        memory.follow("Navigation/MotionDetected", lambda _: self._distract("NavigationMotion", None))
        population.watch(lambda: self._enabled and not self._paused, self._update, blind=self._halt)

    # --- running -----------------------------------------------------------------------------------------------------

    @remote("v(b)")
    def setEnabled(self, enabled: bool) -> None:
        """Switches awareness on or off; switched off, it is no longer paused either."""
        self._enabled = enabled
        if not enabled:
            self._set_paused(False)
            self.attention.release()

    @remote("b()")
    def isEnabled(self) -> bool:
        """Whether awareness is on."""
        return self._enabled

    @remote("b()", name="isRunning")
    def isRunningNow(self) -> bool:
        """Whether awareness is on, and paused neither by a call nor by a motion of the head."""
        return self._enabled and not self._paused and not self._motion.tasks.using(HEAD)

    @remote("v()")
    def startAwareness(self) -> None:
        """Switches awareness on (older name)."""
        self.setEnabled(True)

    @remote("v()")
    def stopAwareness(self) -> None:
        """Switches awareness off (older name)."""
        self.setEnabled(False)

    @remote("b()")
    def isAwarenessRunning(self) -> bool:
        """Whether awareness runs (older name)."""
        return self.isRunningNow()

    @remote("v()")
    def pauseAwareness(self) -> None:
        """Pauses awareness; the robot no longer moves by itself."""
        self._set_paused(True)

    @remote("v()")
    def resumeAwareness(self) -> None:
        """Resumes awareness."""
        self._set_paused(False)

    @remote("b()")
    def isAwarenessPaused(self) -> bool:
        """Whether awareness is paused."""
        return self._paused

    # --- settings ----------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def setEngagementMode(self, modeName: str) -> None:
        """Sets how strongly the robot focuses on one person."""
        self.attention.engagement = one_of(modeName, ENGAGEMENT_MODES, "modeName")

    @remote("s()")
    def getEngagementMode(self) -> str:
        """Returns how strongly the robot focuses on one person."""
        return self.attention.engagement

    @remote("v(s)")
    def setTrackingMode(self, modeName: str) -> None:
        """Sets which parts of its body the robot turns towards people."""
        self.attention.tracking = one_of(modeName, TRACKING_MODES, "modeName")

    @remote("s()")
    def getTrackingMode(self) -> str:
        """Returns which parts of its body the robot turns towards people."""
        return self.attention.tracking

    @remote("v(sb)")
    def setStimulusDetectionEnabled(self, stimulusName: str, enable: bool) -> None:
        """Switches attention to a kind of stimulus on or off."""
        self._stimuli[one_of(stimulusName, STIMULI, "stimulusName")] = enable

    @remote("b(s)")
    def isStimulusDetectionEnabled(self, stimulusName: str) -> bool:
        """Whether the robot pays attention to a kind of stimulus."""
        return self._stimuli[one_of(stimulusName, STIMULI, "stimulusName")]

    @remote("v(sm)")
    def setParameter(self, paramName: str, newVal: Any) -> None:
        """Sets a parameter; the two speeds are above 0 and at most 1."""
        one_of(paramName, self._parameters, "paramName")
        if not isinstance(newVal, int | float):
            raise ServiceError(f"newVal must be a number, got {shown(newVal)}")
        if paramName in _SPEEDS and not 0.0 < newVal <= 1.0:
            raise ServiceError(f"newVal of {paramName} must be above 0 and at most 1, got {newVal:g}")
        self._parameters[paramName] = newVal

    @remote("m(s)")
    def getParameter(self, paramName: str) -> Any:
        """Returns a parameter."""
        return self._parameters[one_of(paramName, self._parameters, "paramName")]

    @remote("v()")
    def resetAllParameters(self) -> None:
        """Restores all parameters."""
        self._parameters = dict(_DEFAULTS)

    # --- people ------------------------------------------------------------------------------------------------------

    @remote("b(i)")
    def engagePerson(self, engagePerson: int) -> bool:
        """Turns to a person of PeopleList; false if awareness does not run or the person is not seen."""
        return self.isRunningNow() and self.attention.track(engagePerson)

    @remote("i([f])")
    def triggerStimulus(self, stimulusPosition: list[float]) -> concurrent.futures.Future | int:
        """Looks at a place [x, y, z] of the world for a person; returns the ID of whom it finds there, or -1."""
        if len(stimulusPosition) != 3:
            raise ServiceError(f"stimulusPosition must be [x, y, z], got {len(stimulusPosition)} numbers")
        if not self.isRunningNow() or not self._motion.stiffness.awake:
            return NOBODY
        return self._workers.run(self._search, stimulusPosition)

    def follow_life(self, able: bool) -> None:
        """Switch awareness as ALAutonomousLife says: its switch or the state of life has changed."""
        self.setEnabled(able)

    def configure(self, engagement: str, tracking: str) -> None:
        """Take the modes that autonomous life sets, and all else as at the start."""
        self._parameters, self._stimuli = dict(_DEFAULTS), dict(_STIMULI_AT_START)
        self.attention.engagement, self.attention.tracking = engagement, tracking

    # --- inside ------------------------------------------------------------------------------------------------------

    def _announce(self, event: str, value: Any) -> None:
        self._memory.announce(f"ALBasicAwareness/{event}", value)

    def _set_paused(self, paused: bool) -> None:
        with self.attention.lock:
            changed, self._paused = self._paused != paused, paused
            if paused:
                self.attention.halt()
        if changed:
            self._announce("PauseStateChanged", paused)

    def _update(self, look: Look) -> None:
        with self.attention.lock:
            if self._motion.stiffness.awake and self.isRunningNow():
                self.attention.update(
                    look,
                    people=self._stimuli["People"],
                    look_speed=self._parameters["LookStimulusSpeed"],
                    back_speed=self._parameters["LookBackSpeed"],
                )
            else:
                self.attention.halt()

    def _halt(self) -> None:
        with self.attention.lock:
            self.attention.halt()

    def _touched(self, changes: Any) -> None:
        try:
            touched = any(row[1] for row in changes)
        except (TypeError, IndexError, KeyError):
            return  # raised by a client: not what the body raises
        if touched:
            self._distract("Touch", {"HeadYaw": 0.0, "HeadPitch": UPWARDS})

    def _heard(self, value: Any) -> None:
        try:
            azimuth, elevation = (finite(angle, "SoundLocated") for angle in value[1][:2])
        except (TypeError, ValueError, IndexError, KeyError, ServiceError):
            return  # raised by a client: no direction
        if max(abs(azimuth), abs(elevation)) > math.pi:
            return  # there is none such, and the head would be on its way for ever
        self._distract("Sound", {"HeadYaw": azimuth, "HeadPitch": -elevation})

    def _distract(self, name: str, angles: dict[str, float] | None) -> None:
        """Look where a stimulus came from, or only report it if it has no direction."""
        if not self._stimuli[name] or not self.isRunningNow() or not self.attention.listens():
            return
        self._announce("StimulusDetected", name)
        if angles is not None:
            self.attention.look_for(angles, self._time_to_search(angles))

    def _search(self, position: list[float]) -> int:
        angles = head_angles(self._robot, position)
        seconds = self._time_to_search(angles)
        stimulus = self.attention.look_for(angles, seconds)
        self._workers.wait_until(lambda: stimulus.over or not self.isRunningNow(), seconds + _SEARCH_PATIENCE)
        return stimulus.found

    def _time_to_search(self, angles: dict[str, float]) -> float:
        """Return the time that the head needs, and the search after it [s]."""
        now = self._robot.snapshot().joint_setpoints
        speed = self._parameters["LookStimulusSpeed"] * self._robot.LIMITS["HeadYaw"].velocity
        way = max(abs(angle - now[joint]) for joint, angle in angles.items())
        return way / speed + self._parameters["MaxHumanSearchTime"] + 0.3
