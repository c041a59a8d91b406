"""ALAutonomousLife: the robot's state of life and the activity in focus.

The simulated robot starts awake in state "disabled", as teleoperation needs it; a real one starts asleep and turns
"solitary" by itself. As on the robot, "disabled" sends it to rest, any other state wakes it up, and while it lives its
base turns to people. Source: NAOqi 2.8 documentation, ALAutonomousLife and ref/life: autonomous_abilities_management.
"""

from __future__ import annotations

import concurrent.futures
import time
from typing import Any

from pepper_sim.naoqi.installed_packages import InstalledPackages
from pepper_sim.naoqi.motion.stiffness import MotionStiffness
from pepper_sim.naoqi.other_services import OtherServices
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.services.al_memory import ALMemory

STATES = ("solitary", "interactive", "safeguard", "disabled")
ABILITIES = ("AutonomousBlinking", "BackgroundMovement", "BasicAwareness", "ListeningMovement", "SpeakingMovement")
ALL = "All"
LIVING = ("solitary", "interactive")
"""States in which the autonomous abilities work."""
_AWARENESS = {"solitary": ("Unengaged", "BodyRotation"), "interactive": ("FullyEngaged", "BodyRotation")}
"""State -> the modes of engagement and tracking that ALBasicAwareness gets with it."""
_AWARENESS_AT_START = ("Unengaged", "Head")
SAFEGUARDS = ("RobotPushed", "RobotFell", "RobotMoved", "CriticalDiagnosis", "CriticalTemperature")
_HISTORY = 200


class ALAutonomousLife(Module):
    """Manages the state of life and the activity in focus.

    Args:
        packages: Their behaviours are the activities that switchFocus accepts, "package-uuid/behaviour-path".
    """

    name = "ALAutonomousLife"

    def __init__(
        self, memory: ALMemory, stiffness: MotionStiffness, packages: InstalledPackages, others: OtherServices
    ) -> None:
        self._memory = memory
        self._others = others
        self._stiffness = stiffness
        self._packages = packages
        self._state = "disabled"
        self._focus: list[str] = []
        self._states: list[tuple[str, float]] = [(self._state, time.time())]
        self._focused: list[tuple[str, float]] = []
        self._runs: list[tuple[str, float, float | None]] = []
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
        if (before, state) == ("interactive", "solitary"):
            self._state = before
            raise ServiceError("an interactive state ends by itself, and by 'disabled' or 'safeguard'")
        self._states = [*self._states[-_HISTORY:], (state, time.time())]
        self._memory.announce("AutonomousLife/State", state)
        self._configure_awareness()
        for ability in ABILITIES:
            self._switch(ability)
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
        """Returns the time as life sees it [s since 1970]."""
        return int(time.time())

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
        self._runs = [*self._runs[-_HISTORY:], (activity_name, time.time(), None)]
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
        """Returns activity -> {prevFocusTime, prevUnfocusTime, focusCount, totalDuration} [s]; 0 if it never ran."""
        names = ("prevFocusTime", "prevUnfocusTime", "focusCount", "totalDuration")
        statistics = {activity: dict.fromkeys(names, 0) for activity in self._packages.behaviors}
        for activity, begin, end in self._runs:
            entry = statistics.setdefault(activity, dict.fromkeys(names, 0))
            entry["prevFocusTime"] = int(begin)
            entry["focusCount"] += 1
            if end is not None:
                entry["prevUnfocusTime"] = int(end)
                entry["totalDuration"] += int(end - begin)
        return statistics

    @remote("m()")
    def getAutonomousActivityStatistics(self) -> dict:
        """Returns the same for activities that start by themselves: none does here."""
        return {}

    @remote("[s](s)")
    def getActivityContextPermissionViolations(self, activity_name: str) -> list[str]:
        """Lists what forbids an activity now: "error" if there is no such activity, "canRunInSleep" if it sleeps."""
        if activity_name not in self._packages.behaviors:
            return ["error"]
        return [] if self._stiffness.awake else ["canRunInSleep"]

    @remote("m(s)")
    def getFocusContext(self, key_name: str) -> list:
        """Returns a key's value when an activity started by itself; no activity here has such a condition."""
        raise ServiceError(f"key_name: '{shown(key_name)[1:-1]}' is in no activity's launch condition")

    @remote("s(s)")
    def getActivityNature(self, activity_name: str) -> str:
        """Returns "interactive" for an installed activity."""
        if activity_name not in self._packages.behaviors:
            raise ServiceError(f"activity '{shown(activity_name)[1:-1]}' is not installed")
        return "interactive"

    # --- abilities and safeguards ------------------------------------------------------------------------------------

    @remote("v(sb)")
    def setAutonomousAbilityEnabled(self, autonomousAbility: str, enabled: bool) -> None:
        """Switches an autonomous ability, or "All", on or off."""
        one_of(autonomousAbility, (*ABILITIES, ALL), "autonomousAbility")
        for ability in ABILITIES if autonomousAbility == ALL else (autonomousAbility,):
            self._abilities[ability] = enabled
            if self._lives(ability):
                self._switch(ability)

    @remote("b(s)")
    def getAutonomousAbilityEnabled(self, autonomousAbility: str) -> bool:
        """Whether an autonomous ability, or every one ("All"), is on."""
        one_of(autonomousAbility, (*ABILITIES, ALL), "autonomousAbility")
        return all(self._abilities.values()) if autonomousAbility == ALL else self._abilities[autonomousAbility]

    @remote("[(sbb)<AutonomousAbilityStatus,name,enabled,running>]()")
    def getAutonomousAbilitiesStatus(self) -> list[tuple[str, bool, bool]]:
        """Lists the abilities, whether they are on, and whether they work now."""
        return [(name, on, self._runs_now(name)) for name, on in self._abilities.items()]

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

    def is_on(self) -> bool:
        """Whether the robot lives, and its autonomous abilities with it."""
        return self._state in LIVING

    def _configure_awareness(self) -> None:
        awareness: Any = self._others.find("ALBasicAwareness")
        if awareness is not None:
            awareness.configure(*_AWARENESS.get(self._state, _AWARENESS_AT_START))

    def _switch(self, ability: str) -> None:
        """Tell an ability's service what the state of life and its own switch say."""
        service: Any = self._others.find(f"AL{ability}")
        if service is not None:
            service.follow_life(self._lives(ability) and self._abilities[ability])

    def _lives(self, ability: str) -> bool:
        """Whether the state of life lets an ability work; some are on in every state."""
        return self.is_on() or getattr(self._others.find(f"AL{ability}"), "enabled_at_start", False)

    def _runs_now(self, ability: str) -> bool:
        service: Any = self._others.find(f"AL{ability}")
        if service is None:
            return False
        running = getattr(service, "isRunningNow", None) or service.isRunning
        return bool(running())

    def _complete(self, activity: str) -> None:
        index = next((i for i in reversed(range(len(self._runs))) if self._runs[i][0] == activity), None)
        if index is not None:
            self._runs[index] = (activity, self._runs[index][1], time.time())
        self._memory.announce("AutonomousLife/CompletedActivity", activity)

    def _announce_focus(self) -> None:
        if self._memory.read("AutonomousLife/FocusedActivity") != self.focusedActivity():
            self._memory.announce("AutonomousLife/FocusedActivity", self.focusedActivity())
