"""ALMotion: what the robot does while no command moves it. It breathes, or it comes back to the posture Stand.

Each chain has a mode of its own; the last call decides. Any command takes the joints from it, and it goes on when they
have been left alone for a while (NAOqi 2.8 documentation, idle). Joints without stiffness do nothing.
"""

from __future__ import annotations

import concurrent.futures
import math
import threading
from collections.abc import Mapping
from typing import Any

from pepper_sim.body.postures import STAND
from pepper_sim.naoqi.joint_names import GROUPS
from pepper_sim.naoqi.motion.joints import Knots, MotionJoints
from pepper_sim.naoqi.service import ServiceError, finite, one_of, remote, shown, within
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.robot import Pepper

PATIENCE = 2.0
"""How long joints are left alone before the robot moves them by itself [s]."""
_PARTS = {name: (name,) for name in ("Head", "LArm", "RArm", "Leg")}
_CHAINS = {**_PARTS, "Legs": ("Leg",), "Arms": ("LArm", "RArm"), "Body": tuple(_PARTS)}
_LIMITS = {"Bpm": (5.0, 30.0), "Amplitude": (0.0, 1.0)}
_BREATH = {
    "HeadPitch": -0.03,
    "HipPitch": -0.02,
    "KneePitch": 0.01,
    **{f"{side}ShoulderPitch": 0.03 for side in "LR"},
    "LShoulderRoll": 0.03,
    "RShoulderRoll": -0.03,
    "LElbowRoll": -0.05,
    "RElbowRoll": 0.05,
}
"""How far a breath moves a joint at amplitude 1 [rad]: the arms open, the trunk straightens and sinks back."""
_RETURN_SPEED = 0.1
_POINTS = 8
_REACHED = 0.02
_STILL = 5e-3
"""Setpoints that differ by less [rad] are the same."""


class MotionIdle:
    """Idle part of ALMotion."""

    def __init__(self, robot: Pepper, joints: MotionJoints, alarm: Alarm) -> None:
        self._robot = robot
        self._joints = joints
        self._alarm = alarm
        self._lock = threading.Lock()
        self._modes: dict[str, str] = {}
        self._running: dict[str, concurrent.futures.Future] = {}
        self._seen: dict[str, tuple[float, ...]] = {}
        self._breath: dict[str, float] = {"Bpm": 15.0, "Amplitude": 1.0}

    @remote("v(sb)")
    def setBreathEnabled(self, pChain: str, pIsEnabled: bool) -> None:
        """Starts or stops breathing with a chain."""
        self._switch(pChain, "breath", pIsEnabled)

    @remote("b(s)")
    def getBreathEnabled(self, pChain: str) -> bool:
        """Whether a chain breathes."""
        return self._has(pChain, "breath")

    @remote("v(m)")
    def setBreathConfig(self, pConfig: Any) -> None:
        """Sets [["Bpm", 5 to 30], ["Amplitude", 0 to 1]]."""
        config = dict(self._breath)
        for name, value in named_values(pConfig, "pConfig"):
            one_of(name, _LIMITS, "pConfig")
            config[name] = within(finite(value, name), *_LIMITS[name], name)
        self._breath = config

    @remote("m()")
    def getBreathConfig(self) -> list[list]:
        """Returns [["Bpm", value], ["Amplitude", value]]."""
        return [[name, value] for name, value in self._breath.items()]

    @remote("v(sb)")
    def setIdlePostureEnabled(self, pChain: str, pIsEnabled: bool) -> None:
        """Starts or stops bringing a chain back to the posture Stand."""
        self._switch(pChain, "posture", pIsEnabled)

    @remote("b(s)")
    def getIdlePostureEnabled(self, pChain: str) -> bool:
        """Whether a chain comes back to the posture Stand."""
        return self._has(pChain, "posture")

    def close(self) -> None:
        """Move no more."""
        with self._lock:
            self._modes.clear()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _has(self, chain: str, mode: str) -> bool:
        one_of(chain, _CHAINS, "pChain")
        with self._lock:
            return all(self._modes.get(part) == mode for part in _CHAINS[chain])

    def _switch(self, chain: str, mode: str, on: bool) -> None:
        one_of(chain, _CHAINS, "pChain")
        for part in _CHAINS[chain]:
            with self._lock:
                before = self._modes.get(part)
                if on:
                    self._modes[part] = mode
                    self._seen.pop(part, None)
                elif before == mode:
                    del self._modes[part]
                changed = before != self._modes.get(part)
                running = self._running.setdefault(part, concurrent.futures.Future()) if on else self._running.get(part)
            if before is None and on:
                self._next(part)
            elif changed and running is not None:
                running.cancel()

    def _next(self, part: str) -> None:
        """Start the next movement of a chain, or look again later."""
        with self._lock:
            mode = self._modes.get(part)
            if mode is None:
                self._running.pop(part, None)
                return
        movement = self._breathe(part) if mode == "breath" else self._return(part)
        future = movement or self._alarm.after(PATIENCE)
        with self._lock:
            self._running[part] = future
            changed = self._modes.get(part) != mode
        future.add_done_callback(lambda done: self._over(part, done))
        if changed:
            future.cancel()

    def _over(self, part: str, done: concurrent.futures.Future) -> None:
        if done.cancelled() or done.result() in (True, None):  # None: the alarm's
            self._next(part)
            return
        pause = self._alarm.after(PATIENCE)  # a command took the joints
        with self._lock:
            self._running[part] = pause
        pause.add_done_callback(lambda _: self._next(part))

    def _breathe(self, part: str) -> concurrent.futures.Future | None:
        joints = [joint for joint in GROUPS[part] if joint in _BREATH]
        if self._limp(joints) or self._moved(part) is True:
            return None
        period, amplitude = 60.0 / self._breath["Bpm"], self._breath["Amplitude"]

        def knots(setpoints: Mapping[str, float]) -> Knots:
            shares = [(n / _POINTS, 0.5 - 0.5 * math.cos(math.tau * n / _POINTS)) for n in range(1, _POINTS + 1)]
            return {
                joint: [(t * period, setpoints[joint] + share * amplitude * _BREATH[joint]) for t, share in shares]
                for joint in joints
            }

        return self._joints.plan("breath", joints, knots, yields=True)

    def _return(self, part: str) -> concurrent.futures.Future | None:
        joints = GROUPS[part]
        setpoints = self._robot.snapshot().joint_setpoints
        there = all(abs(setpoints[joint] - STAND[joint]) < _REACHED for joint in joints)
        if self._moved(part) is not False or there or self._limp(joints):
            return None
        return self._joints.go({joint: STAND[joint] for joint in joints}, _RETURN_SPEED, "idlePosture", yields=True)

    def _moved(self, part: str) -> bool | None:
        """Whether something has moved a chain since the last look; None at the first one."""
        setpoints = self._robot.snapshot().joint_setpoints
        here = tuple(setpoints[joint] for joint in GROUPS[part])
        before, self._seen[part] = self._seen.get(part), here
        return None if before is None else max(abs(a - b) for a, b in zip(here, before, strict=True)) > _STILL

    def _limp(self, joints: Any) -> bool:
        stiffness = self._robot.snapshot().stiffness
        return not all(stiffness[joint] for joint in joints)


def named_values(value: Any, argument: str) -> list[tuple[str, Any]]:
    """Return the pairs of [[name, value], ...].

    Raises: ServiceError: It is something else; the text names `argument`.
    """
    if not isinstance(value, list | tuple) or not all(
        isinstance(item, list | tuple) and len(item) == 2 and isinstance(item[0], str) for item in value
    ):
        raise ServiceError(f"{argument} must be [[name, value], ...], got {shown(value)}")
    return [(name, item) for name, item in value]
