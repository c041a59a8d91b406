"""What a pilot must know about a robot besides its picture: the battery, and what has failed.

Subscribes: the robot's battery (sensor_msgs/BatteryState); /station/faults (telepresence_msgs/Fault): what those who
            restart programs report.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Collection
from typing import Any

import rospy
from sensor_msgs.msg import BatteryState
from telepresence_msgs.msg import Fault

from telepresence.security.outside_text import clean, clean_name
from telepresence.station.fault_sentences import OLDEST_REPORT, SILENT_AFTER, Cause, Faults
from telepresence.teleop.robot_readings import Battery, read_battery

BATTERY_LIFE = 30.0
"""[s] for which the battery's state counts."""
_LONGEST = 80


class Health:
    """Battery and faults of one robot.

    Args:
        title: What people call it.
        namespace: Of its topics; others: those of the other robots.
        battery: Full name of the topic.
    """

    def __init__(self, title: str, namespace: str, others: Collection[str], battery: str) -> None:
        self._faults = Faults(title, namespace, others)
        self._lock = threading.Lock()
        self._battery: Battery | None = None
        self._gate_spoke: float | None = None
        rospy.Subscriber(battery, BatteryState, self._on_battery, queue_size=1)
        rospy.Subscriber("/station/faults", Fault, self._on_fault, queue_size=20)

    def on_gate(self) -> None:
        """The safety gate has spoken."""
        self._gate_spoke = time.monotonic()

    def state(self) -> dict[str, Any]:
        """Return what the page shows of it, as JSON's types: `battery` has a share, 0 to 1, or a voltage [V], each may
        be null; `fault` is a sentence, or empty."""
        now = time.monotonic()
        with self._lock:
            silent = self._gate_spoke is not None and now - self._gate_spoke > SILENT_AFTER
            self._faults.notice(Cause.DRIVER, silent, now)
            fault = self._faults.current(now)
        return {"battery": self._battery_state(now), "fault": fault.sentence if fault else ""}

    def _battery_state(self, now: float) -> dict[str, Any] | None:
        battery = self._battery
        if battery is None or now - battery.arrived > BATTERY_LIFE:
            return None
        return {
            "share": round(battery.share, 2) if math.isfinite(battery.share) else None,
            "voltage": round(battery.voltage, 1) if math.isfinite(battery.voltage) else None,
            "charging": battery.charging,
            "low": battery.low,
        }

    def _on_battery(self, message: BatteryState) -> None:
        self._battery = read_battery(message, time.monotonic())

    def _on_fault(self, message: Fault) -> None:
        if abs(time.time() - message.stamp.to_sec()) > OLDEST_REPORT:
            return
        what, then = clean(message.what, _LONGEST), clean(message.next, _LONGEST)
        with self._lock:
            self._faults.report(clean_name(message.program), what, then, time.monotonic())
