"""ALAutonomousLife: the robot's state of life and the activity in focus.

The simulated robot starts awake in state "disabled", as teleoperation needs it; a real one starts asleep and turns
"solitary" by itself. As on the robot, "disabled" sends it to rest, and any other state wakes it up. Source: NAOqi 2.8
documentation, ALAutonomousLife.
"""

from __future__ import annotations

import concurrent.futures
import time

from pepper_sim.naoqi.installed_packages import InstalledPackages
from pepper_sim.naoqi.motion.stiffness import MotionStiffness
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.services.al_memory import ALMemory

STATES = ("solitary", "interactive", "safeguard", "disabled")
ABILITIES = ("AutonomousBlinking", "BackgroundMovement", "BasicAwareness", "ListeningMovement", "SpeakingMovement")
SAFEGUARDS = ("RobotPushed", "RobotFell", "RobotMoved", "CriticalDiagnosis", "CriticalTemperature")
_HISTORY = 200


class ALAutonomousLife(Module):
    """Manages the state of life and the activity in focus.

    Args:
        packages: Their behaviours are the activities that switchFocus accepts, "package-uuid/behaviour-path".
    """

    name = "ALAutonomousLife"

    def __init__(self, memory: ALMemory, stiffness: MotionStiffness, packages: InstalledPackages) -> None:
        self._memory = memory
        self._stiffness = stiffness
        self._packages = packages
        self._started = time.monotonic()
        self._state = "disabled"
        self._focus: list[str] = []
        self._states: list[tuple[str, float]] = [(self._state, time.time())]
        self._focused: list[tuple[str, float]] = []
        self._abilities = dict.fromkeys(ABILITIES, True)
        self._safeguards = dict.fromkeys(SAFEGUARDS, True)
        self._offset = 0.0
        memory.declare(("AutonomousLife/CompletedActivity", "AutonomousLife/NextActivity"), self.name)
        memory.declare(("AutonomousLife/State", "AutonomousLife/FocusedActivity"), self.name)
        memory.store("AutonomousLife/State", self._state)
        for activity in ("FocusedActivity", "CompletedActivity", "NextActivity"):
            memory.store(f"AutonomousLife/{activity}", "")
        memory.store("AutonomousLife/LaunchSuggestions", [])

    # --- state -------------------------------------------------------------------------------------------------------

    @remote("s()")
    def getState(self) -> str:
        """Returns solitary, interactive, safeguard or disabled."""
        return self._state

    @remote("v(s)")
    def setState(self, state: str) -> concurrent.futures.Future | None:
        """Changes the state of life; ends when the robot is awake or, for "disabled", at rest."""
        before, self._state = self._state, one_of(state, STATES, "state")
        if state == before:
            return None
        self._states = [*self._states[-_HISTORY:], (state, time.time())]
        self._memory.announce("AutonomousLife/State", state)
        if state in ("disabled", "safeguard"):
            self.stopAll()
        if state == "disabled":
            return self._stiffness.rest()
        return None if self._stiffness.awake else self._stiffness.wakeUp()

    @remote("m()", "m(i)")
    def getStateHistory(self, depth: int = _HISTORY) -> list[list]:
        """Lists [state, [seconds, microseconds]], newest last."""
        return [[state, split_stamp(stamp)] for state, stamp in self._states[-max(1, depth) :]]

    @remote("i()")
    def getLifeTime(self) -> int:
        """Returns the seconds since the robot started."""
        return int(time.monotonic() - self._started)

    # --- focus -------------------------------------------------------------------------------------------------------

    @remote("i(s)", "i(si)")
    def switchFocus(self, activity_name: str, flags: int = 0) -> int:
        """Puts an installed activity in focus; flags 0 ends the current one, 1 keeps it on the stack.

        What the number that the robot returns means is not documented; here it is 0.
        """
        one_of(flags, (0, 1), "flags")
        if activity_name not in self._packages.behaviors:
            raise ServiceError(f"activity '{shown(activity_name)[1:-1]}' is not installed")
        if flags == 0 and self._focus:
            self._complete(self._focus.pop())
        self._focus.append(activity_name)
        self._focused = [*self._focused[-_HISTORY:], (activity_name, time.time())]
        self._announce_focus()
        return 0

    @remote("v()")
    def stopFocus(self) -> None:
        """Ends the activity in focus; the one below it on the stack, if any, gets the focus back."""
        if self._focus:
            self._complete(self._focus.pop())
            self._announce_focus()

    @remote("v()")
    def stopAll(self) -> None:
        """Ends every activity."""
        while self._focus:
            self._complete(self._focus.pop())
        self._announce_focus()

    @remote("s()")
    def focusedActivity(self) -> str:
        """Returns the activity in focus, or ""."""
        return self._focus[-1] if self._focus else ""

    @remote("m()", "m(i)")
    def getFocusHistory(self, depth: int = _HISTORY) -> list[list]:
        """Lists [activity, [seconds, microseconds]], newest last."""
        return [[activity, split_stamp(stamp)] for activity, stamp in self._focused[-max(1, depth) :]]

    @remote("m()")
    def getActivityStatistics(self) -> dict:
        """Returns activity -> {"prevStartTime", "startCount"}."""
        statistics: dict[str, dict[str, int]] = {}
        for activity, stamp in self._focused:
            entry = statistics.setdefault(activity, {"prevStartTime": 0, "startCount": 0})
            entry["prevStartTime"] = int(stamp)
            entry["startCount"] += 1
        return statistics

    @remote("s(s)")
    def getActivityNature(self, activity_name: str) -> str:
        """Returns "interactive" for an installed activity."""
        if activity_name not in self._packages.behaviors:
            raise ServiceError(f"activity '{shown(activity_name)[1:-1]}' is not installed")
        return "interactive"

    # --- abilities and safeguards ------------------------------------------------------------------------------------

    @remote("v(sb)")
    def setAutonomousAbilityEnabled(self, autonomousAbility: str, enabled: bool) -> None:
        """Switches an autonomous ability on or off."""
        self._abilities[one_of(autonomousAbility, ABILITIES, "autonomousAbility")] = enabled

    @remote("b(s)")
    def getAutonomousAbilityEnabled(self, autonomousAbility: str) -> bool:
        """Whether an autonomous ability is on."""
        return self._abilities[one_of(autonomousAbility, ABILITIES, "autonomousAbility")]

    @remote("m()")
    def getAutonomousAbilitiesStatus(self) -> list[list]:
        """Lists [ability, enabled, running]; none runs while life is disabled."""
        return [[name, on, on and self._state != "disabled"] for name, on in self._abilities.items()]

    @remote("v(sb)")
    def setSafeguardEnabled(self, safeguard: str, enabled: bool) -> None:
        """Switches a safeguard on or off. Stored only."""
        self._safeguards[one_of(safeguard, SAFEGUARDS, "safeguard")] = enabled

    @remote("b(s)")
    def isSafeguardEnabled(self, safeguard: str) -> bool:
        """Whether a safeguard is on."""
        return self._safeguards[one_of(safeguard, SAFEGUARDS, "safeguard")]

    @remote("v(f)")
    def setRobotOffsetFromFloor(self, offset: float) -> None:
        """Sets how high above the floor the robot stands [m]. Stored only."""
        self._offset = offset

    @remote("f()")
    def getRobotOffsetFromFloor(self) -> float:
        """Returns how high above the floor the robot stands [m]."""
        return self._offset

    def _complete(self, activity: str) -> None:
        self._memory.announce("AutonomousLife/CompletedActivity", activity)

    def _announce_focus(self) -> None:
        if self._memory.read("AutonomousLife/FocusedActivity") != self.focusedActivity():
            self._memory.announce("AutonomousLife/FocusedActivity", self.focusedActivity())
