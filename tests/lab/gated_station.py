"""A robot behind its safety gate: who drives it, what the gate says, and how long it takes to stand."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

STOP_WITHIN = 1.0 + 0.5
"""Seconds to a stand after a fault; the half is for a machine that is shared."""
STANDING = 0.005
"""Slower than this the robot stands [m/s]."""
SAFETY = ["state", "reason", "vx", "vy", "wz", "gap", "sector", "allowed", "command_age"]


class GatedStation:
    """Listens to one robot.

    Args:
        pilot: The probe of `tests/catkin_ws/ros_probe.py` that drives and listens.
        until: Waits for a condition.
        namespace: Namespace of the robot's topics and services.
        axis: "x" or "y", along which the tests drive.
    """

    def __init__(self, pilot, until: Callable, namespace: str, axis: str) -> None:
        self.pilot, self._until, self._namespace = pilot, until, namespace
        pilot.watch(
            f"{namespace}/odom", "nav_msgs/Odometry", [f"pose.pose.position.{axis}", f"twist.twist.linear.{axis}"]
        )
        pilot.watch(f"{namespace}/safety", "telepresence_msgs/SafetyState", SAFETY)
        pilot.watch(f"{namespace}/safety_state", "std_msgs/String", ["data"])
        pilot.watch(f"{namespace}/drive_state", "std_msgs/String", ["data"])
        self.until(lambda: pilot.subscribers() == 1, "somebody listens to the pilot")

    @property
    def safety(self) -> dict:
        """The newest decision."""
        return dict(zip(SAFETY, self.pilot.newest(f"{self._namespace}/safety"), strict=True))

    @property
    def drive_state(self) -> str:
        return self.pilot.newest(f"{self._namespace}/drive_state")[0]

    def place(self) -> float:
        """Along the axis [m]."""
        return self.pilot.latest(f"{self._namespace}/odom")[0]

    def speed(self) -> float:
        """Along the axis [m/s]."""
        return self.pilot.latest(f"{self._namespace}/odom")[1]

    def trigger(self, service: str) -> dict:
        worked, answer = self.pilot.call(f"{self._namespace}/{service}", "std_srvs/Trigger", {})
        assert worked, answer
        return answer

    def let_go(self) -> None:
        """Nothing latched, nobody drives, the robot stands."""
        self.pilot.silence()
        self.trigger("reset_stop")
        self.until(lambda: self.trigger("reset_bumper")["success"], "the bumper can be reset")
        self.until(lambda: abs(self.speed()) < STANDING, "the robot stands")
        self.until(lambda: self.safety["state"] == "no command", "nothing else is wrong")

    def time_to_stand(self, since: float) -> float:
        """Return the seconds from `since` until the odometry shows no more speed."""

        def stood():
            seen = self.pilot.seen(f"{self._namespace}/odom")
            return next((at for at, value in seen if at > since and abs(value[1]) < STANDING), None)

        return self.until(stood, "the robot stands") - since

    def until(self, condition: Callable[[], object], what: str) -> object:
        """Wait for a condition; a failure says what gate and driver said."""
        try:
            return self._until(condition, what)
        except AssertionError as failure:
            pytest.fail(f"{failure}; the gate: {self.safety}; the driver: {self.drive_state}")

    def told(self, text: str) -> None:
        topic = f"{self._namespace}/safety_state"
        self.until(lambda: text in self.pilot.newest(topic)[0], f"the gate says {text!r}")

    def stays(self, seconds: float = 0.4) -> None:
        """The robot comes to stand, and does so although somebody drives."""
        self.until(lambda: abs(self.speed()) < STANDING, "the robot stands")
        ends = time.monotonic() + seconds
        while time.monotonic() < ends:
            assert abs(self.speed()) < STANDING
