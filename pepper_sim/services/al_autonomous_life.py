"""ALAutonomousLife: the robot's state of life and the activity in focus.

The simulated robot starts awake in state "disabled", as teleoperation needs it; a real one starts asleep and turns
"solitary" by itself. As on the robot, "disabled" sends it to rest, any other state wakes it up, and while it lives its
base turns to people. Only then can an activity be in focus; an interactive one makes the state "interactive" until the
last one has ended. Source: NAOqi 2.8 documentation, ALAutonomousLife, and the pages state_machine_management and
autonomous_abilities_management of ref/life.
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
        if one_of(state, STATES, "state") == self._state:
            return None
        if (self._state, state) == ("interactive", "solitary"):
            raise ServiceError("an interactive state ends by itself, and by 'disabled' or 'safeguard'")
        self._enter(state)
        if state not in LIVING:
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
        """Puts an installed activity in focus, in its nature's state of life; none while life is disabled or guarded.

        flags 0 ends the current activity, 1 keeps it on the stack. A solitary one does not follow an interactive one.
        What the number that the robot returns means is not documented; here it is 0.
        """
        one_of(flags, (0, 1), "flags")
        nature = self.getActivityNature(activity_name)
        if self._state not in LIVING:
            raise ServiceError(f"no activity can be in focus while the state of life is '{self._state}'")
        if (self._state, nature) == ("interactive", "solitary"):
            raise ServiceError("a solitary activity cannot be in focus while the state of life is 'interactive'")
        if flags == 0 and self._focus:
            self._complete(self._focus.pop())
        self._enter(nature)
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
            self._settle()

    @remote("v()")
    def stopAll(self) -> None:
        """Ends every activity."""
        if self._focus:
            while self._focus:
                self._complete(self._focus.pop())
            self._settle()

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
        """Returns "solitary" if the manifest of an installed activity says so, else "interactive"."""
        if activity_name not in self._packages.behaviors:
            raise ServiceError(f"activity '{shown(activity_name)[1:-1]}' is not installed")
        return self._nature(activity_name)

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

    def _enter(self, state: str) -> None:
        """Enter a state, or enforce it anew: an activity that begins or ends finds everything as the state has it."""
        if state != self._state:
            self._state = state
            self._states = [*self._states[-_HISTORY:], (state, time.time())]
            self._memory.announce("AutonomousLife/State", state)
        awareness: Any = self._others.find("ALBasicAwareness")
        if awareness is not None:
            awareness.configure(*_AWARENESS.get(state, _AWARENESS_AT_START))
        for ability in ABILITIES:
            self._switch(ability)

    def _nature(self, activity: str) -> str:
        return "solitary" if self._packages.nature(activity) == "solitary" else "interactive"

    def _settle(self) -> None:
        """Go on with the activity below those that have ended, or without any."""
        if self._state in LIVING:
            self._enter(self._nature(self._focus[-1]) if self._focus else "solitary")
        self._announce_focus()

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
