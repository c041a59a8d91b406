"""ALBasicAwareness: attention to people and noises. Settings are stored; no stimulus is ever detected."""

from __future__ import annotations

from typing import Any

from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.services.al_memory import ALMemory

ENGAGEMENT_MODES = ("Unengaged", "FullyEngaged", "SemiEngaged")
TRACKING_MODES = ("Head", "BodyRotation", "WholeBody", "MoveContextually")
STIMULI = ("People", "Touch", "TabletTouch", "Sound", "Movement", "NavigationMotion")
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
"""Names and values of the NAOqi 2.8 documentation, ALBasicAwareness."""


class ALBasicAwareness(Module):
    """Keeps the settings of awareness."""

    name = "ALBasicAwareness"

    def __init__(self, memory: ALMemory) -> None:
        self._enabled = False
        self._paused = False
        self._engagement = "Unengaged"
        self._tracking = "Head"
        self._stimuli = {name: name != "NavigationMotion" for name in STIMULI}
        self._parameters = dict(_DEFAULTS)
        memory.declare(
            f"ALBasicAwareness/{event}"
            for event in ("HumanTracked", "HumanLost", "StimulusDetected", "PauseStateChanged")
        )

    @remote("v(b)")
    def setEnabled(self, enabled: bool) -> None:
        """Switches awareness on or off."""
        self._enabled = enabled

    @remote("b()")
    def isEnabled(self) -> bool:
        """Whether awareness is on."""
        return self._enabled

    @remote("b()", name="isRunning")
    def isRunningNow(self) -> bool:
        """Whether awareness is on and not paused."""
        return self._enabled and not self._paused

    @remote("v()")
    def startAwareness(self) -> None:
        """Switches awareness on (older name)."""
        self._enabled = True

    @remote("v()")
    def stopAwareness(self) -> None:
        """Switches awareness off (older name)."""
        self._enabled = False

    @remote("b()")
    def isAwarenessRunning(self) -> bool:
        """Whether awareness runs (older name)."""
        return self.isRunningNow()

    @remote("v()")
    def pauseAwareness(self) -> None:
        """Pauses awareness."""
        self._paused = True

    @remote("v()")
    def resumeAwareness(self) -> None:
        """Resumes awareness."""
        self._paused = False

    @remote("b()")
    def isAwarenessPaused(self) -> bool:
        """Whether awareness is paused."""
        return self._paused

    @remote("v(s)")
    def setEngagementMode(self, modeName: str) -> None:
        """Sets how strongly the robot focuses on one person."""
        self._engagement = one_of(modeName, ENGAGEMENT_MODES, "modeName")

    @remote("s()")
    def getEngagementMode(self) -> str:
        """Returns how strongly the robot focuses on one person."""
        return self._engagement

    @remote("v(s)")
    def setTrackingMode(self, modeName: str) -> None:
        """Sets which parts of its body the robot turns towards people."""
        self._tracking = one_of(modeName, TRACKING_MODES, "modeName")

    @remote("s()")
    def getTrackingMode(self) -> str:
        """Returns which parts of its body the robot turns towards people."""
        return self._tracking

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
        """Sets a parameter."""
        one_of(paramName, self._parameters, "paramName")
        if not isinstance(newVal, int | float):
            raise ServiceError(f"newVal must be a number, got {shown(newVal)}")
        self._parameters[paramName] = newVal

    @remote("m(s)")
    def getParameter(self, paramName: str) -> Any:
        """Returns a parameter."""
        return self._parameters[one_of(paramName, self._parameters, "paramName")]

    @remote("v()")
    def resetAllParameters(self) -> None:
        """Restores all parameters."""
        self._parameters = dict(_DEFAULTS)

    @remote("b(i)")
    def engagePerson(self, engagePerson: int) -> bool:
        """Turns to a person; none is known: false."""
        return False

    @remote("i([f])")
    def triggerStimulus(self, stimulusPosition: list[float]) -> int:
        """Looks towards a point for a person; nobody is found: -1."""
        if len(stimulusPosition) != 3:
            raise ServiceError(f"stimulusPosition must be [x, y, z], got {len(stimulusPosition)} numbers")
        return -1
