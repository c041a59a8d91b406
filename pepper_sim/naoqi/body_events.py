"""Events that the body raises into ALMemory: touch, bumpers, posture, battery, refused moves."""

from __future__ import annotations

import datetime
import logging
import threading
import time
from collections.abc import Iterable
from typing import Any

from pepper_sim.naoqi import launchpad
from pepper_sim.naoqi.memory_keys import BUMPERS, TOUCH_SENSORS
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_robot_posture import FAMILIES, recognise

log = logging.getLogger(__name__)

PERIOD = 0.02
"""Polling period of the body [s]."""
_SLOW_CYCLES = 50  # posture and battery are polled once a second
_HAND_SIDES = ("HandRightLeftTouched", "HandRightRightTouched", "HandLeftLeftTouched", "HandLeftRightTouched")
"""Documented, although Pepper has touch sensors only on the backs of its hands."""
CLICKS = tuple(f"ALChestButton/{times}ClickOccurred" for times in ("Simple", "Double", "Triple"))
"""Events of the chest button."""
CLICK_PAUSE = 0.4
"""Seconds after which the next click is another one; the documentation gives no value."""
_EVENTS = (
    *(event for _, event in TOUCH_SENSORS.values()),
    *(event for _, event, _ in BUMPERS.values()),
    *_HAND_SIDES,
    *("TouchChanged", "ALMotion/MoveFailed", "ALMotion/RobotIsFalling", "robotHasFallen", "ALMotion/RobotIsStand"),
    *("ALMotion/Safety/ChainVelocityClipped", "ALMotion/Protection/DisabledDevicesChanged"),
    *("PostureChanged", "PostureFamilyChanged", "BodyStiffnessChanged", *CLICKS),
    *("BatteryChargeChanged", "BatteryPowerPluggedChanged", "BatteryChargingFlagChanged"),
)


class BodyEvents:
    """Polls the robot's snapshots on a thread of its own and raises an event for what changed."""

    def __init__(self, robot: Pepper, memory: ALMemory) -> None:
        self._robot = robot
        self._memory = memory
        self._pressed: dict[str, bool] = {}
        self._seen: dict[str, Any] = {}
        self._clicks, self._clicked = 0, 0.0
        self._fell: float | None = None
        robot.world.on_reset(self._forget_clicks)
        self._move_failures = robot.snapshot().move_failed.count
        self._closing = threading.Event()
        memory.declare(_EVENTS)
        for _, event in TOUCH_SENSORS.values():
            memory.store(event, 0.0)
        for _, event, _ in BUMPERS.values():
            memory.store(event, 0.0)
        for event in _HAND_SIDES:
            memory.store(event, 0.0)
        for key, value in (
            ("BatteryPowerPluggedChanged", False),
            ("BatteryChargingFlagChanged", False),
            ("BatteryFullChargedFlagChanged", False),
            ("BatteryTrapIsOpen", False),
            ("ALBattery/ConnectedToChargingStation", False),
            ("TouchChanged", []),
        ):
            memory.store(key, value)
        self._poll_slow_changes(robot.snapshot())
        self._thread = threading.Thread(target=self._run, name="body-events", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        cycle = 0
        while not self._closing.wait(PERIOD):
            try:
                snapshot = self._robot.snapshot()
                self._poll_touch(snapshot)
                self._poll_motion(snapshot)
                cycle += 1
                if cycle % _SLOW_CYCLES == 0:
                    self._poll_slow_changes(snapshot)
            except Exception:  # one event that fails must not end all later ones
                log.exception("the body's events could not be raised")

    def _poll_touch(self, snapshot: Any) -> None:
        changed: list[list] = []
        for name, (device, event) in TOUCH_SENSORS.items():
            changed += self._contact(event, device, bool(snapshot.touch[name]))
        for name, (device, event, _) in BUMPERS.items():
            changed += self._contact(event, device, bool(snapshot.bumpers[name]))
        if changed:
            self._memory.announce("TouchChanged", changed)
        self._poll_clicks()

    def _contact(self, event: str, device: str, pressed: bool) -> Iterable[list]:
        before, self._pressed[event] = self._pressed.get(event, False), pressed
        if before == pressed:
            return ()
        self._memory.announce(event, float(pressed))
        if event == "ChestButtonPressed":
            self._clicks += not pressed
            self._clicked = time.monotonic()
        return ([device, pressed],)

    def _forget_clicks(self) -> None:
        self._clicks = 0

    def _poll_clicks(self) -> None:
        """Tell single, double and triple clicks apart: by what follows within CLICK_PAUSE."""
        held = self._pressed.get("ChestButtonPressed", False)
        if self._clicks and not held and time.monotonic() - self._clicked >= CLICK_PAUSE:
            self._memory.announce(CLICKS[min(self._clicks, len(CLICKS)) - 1], [])
            self._clicks = 0

    def _poll_motion(self, snapshot: Any) -> None:
        failure = snapshot.move_failed
        if failure.count != self._move_failures:
            self._move_failures = failure.count
            self._memory.announce("ALMotion/MoveFailed", [failure.cause, int(failure.started), list(failure.obstacle)])
        if self._changed("fallen", snapshot.fallen) and snapshot.fallen:
            self._fell = time.monotonic()
            self._memory.announce("ALMotion/RobotIsFalling", True)
            self._memory.announce("robotHasFallen", 1)

    def _poll_slow_changes(self, snapshot: Any) -> None:
        posture = recognise(snapshot.joint_positions)
        if self._changed("posture", posture):
            self._memory.announce("PostureChanged", posture)
        family = FAMILIES.get(posture, "Unknown")
        if self._changed("family", family):
            self._memory.announce("PostureFamilyChanged", family)
        if self._changed("stand", family == "Standing"):
            self._memory.announce("ALMotion/RobotIsStand", family == "Standing")
        charge = round(100 * snapshot.battery.charge)
        if self._changed("charge", charge):
            self._memory.announce("BatteryChargeChanged", charge)
        if self._changed("plugged", snapshot.battery.plugged):
            for event in ("BatteryPowerPluggedChanged", "BatteryChargingFlagChanged"):
                self._memory.announce(event, snapshot.battery.plugged)
            self._memory.store("ALBattery/ConnectedToChargingStation", snapshot.battery.plugged)
        stiff = any(value > 0.0 for value in snapshot.stiffness.values())
        if self._changed("stiff", stiff):
            self._memory.announce("BodyStiffnessChanged", stiff)
        fell = None if self._fell is None else time.monotonic() - self._fell
        charging, now = bool(self._memory.read("BatteryChargingFlagChanged")), datetime.datetime.now()
        for key, value in launchpad.values(snapshot, posture, family, charging, fell, now).items():
            if self._changed(key, value):
                self._memory.announce(key, value)

    def _changed(self, what: str, value: Any) -> bool:
        before = self._seen.get(what)
        self._seen[what] = value
        return before != value
