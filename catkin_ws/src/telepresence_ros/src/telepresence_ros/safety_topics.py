"""The ROS topics and services of a safety gate; the same for every robot.

Publishes:  safety (telepresence_msgs/SafetyState): every decision; safety_state (std_msgs/String, latched):
            "<state>: <reason>", when it changes and twice a second, so that readers notice a dead node;
            safety_markers (visualization_msgs/MarkerArray): the same for RViz, while somebody subscribes.
Services:   stop_drive: stop and stay stopped; reset_stop, reset_bumper: reset it (std_srvs/Trigger).
All names are relative to the namespace of the node.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol

import numpy as np
import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse
from telepresence_msgs.msg import SafetyState
from visualization_msgs.msg import MarkerArray

from telepresence.safety import Decision, RobotProfile
from telepresence_ros.safety_markers import draw

STATE_PERIOD = 0.5
"""Seconds after which an unchanged state is repeated."""
MARKER_PERIOD = 0.1
"""Seconds between two drawings."""


class Latches(Protocol):
    """Stops that last until a person resets them. Called on threads of their own."""

    def stop(self, reason: str) -> None: ...

    def reset_stop(self) -> None: ...

    def reset_bumper(self) -> bool:
        """False while a bumper is still pressed."""


class SafetyTopics:
    """Publishes what the gate decides, and serves its latches.

    Args:
        profile: The robot that is drawn.
        frame_id: tf frame of what the profile calls base_link.
        latches: Behind the services; None if the gate has none, then there are no services.
        on_latch: Called after every call of a service, on its thread.
        obstacles: Asked for the places of known obstacles in that frame, (n, 2) [m], before a drawing.
    """

    def __init__(
        self,
        profile: RobotProfile,
        frame_id: str,
        latches: Latches | None,
        obstacles: Callable[[], np.ndarray] | None = None,
        on_latch: Callable[[], None] = lambda: None,
    ) -> None:
        self._profile = profile
        self._frame_id = frame_id
        self._obstacles = obstacles or (lambda: np.empty((0, 2)))
        self._decisions = rospy.Publisher("safety", SafetyState, queue_size=1, tcp_nodelay=True)
        self._states = rospy.Publisher("safety_state", String, queue_size=1, latch=True)
        self._markers = rospy.Publisher("safety_markers", MarkerArray, queue_size=1)
        self._state, self._state_due, self._markers_due = "", 0.0, 0.0
        if latches is not None:
            for name, answer in (
                ("stop_drive", _on_stop),
                ("reset_stop", _on_reset_stop),
                ("reset_bumper", _on_reset_bumper),
            ):
                rospy.Service(name, Trigger, partial(_serve, answer, latches, on_latch))

    def report(self, now: float, decision: Decision) -> None:
        """Publish what was decided at `now` [s, monotonic]."""
        stamp = rospy.Time.now()
        if self._decisions.get_num_connections():
            message = to_message(decision)
            message.header.stamp, message.header.frame_id = stamp, self._frame_id
            self._decisions.publish(message)
        state = f"{decision.state.value}: {decision.reason}"
        if state != self._state or now >= self._state_due:
            self._state, self._state_due = state, now + STATE_PERIOD
            self._states.publish(state)
        if now >= self._markers_due and self._markers.get_num_connections():
            self._markers_due = now + MARKER_PERIOD
            self._markers.publish(draw(self._profile, decision, self._obstacles(), self._frame_id, stamp))


def _serve(
    answer: Callable[[Latches, TriggerRequest], TriggerResponse],
    latches: Latches,
    on_latch: Callable[[], None],
    request: TriggerRequest,
) -> TriggerResponse:
    answered = answer(latches, request)
    on_latch()
    return answered


def _on_stop(latches: Latches, request: TriggerRequest) -> TriggerResponse:
    caller = getattr(request, "_connection_header", {}).get("callerid", "")
    latches.stop(f"stop requested by {caller.lstrip('/')}" if caller else "stop requested")
    return TriggerResponse(True, "stopped until reset_stop")


def _on_reset_stop(latches: Latches, _request: TriggerRequest) -> TriggerResponse:
    latches.reset_stop()
    return TriggerResponse(True, "let go of the controls once to drive again")


def _on_reset_bumper(latches: Latches, _request: TriggerRequest) -> TriggerResponse:
    done = latches.reset_bumper()
    return TriggerResponse(done, "" if done else "the bumper is still pressed")


def to_message(decision: Decision) -> SafetyState:
    """A decision as it goes over the wire, without its header."""
    message = SafetyState()
    message.state, message.reason = decision.state.value, decision.reason
    message.allowed = decision.allowed.tolist()
    message.gap = decision.gap
    message.sector = -1 if decision.sector is None else decision.sector
    message.command_age = decision.command_age
    message.vx, message.vy, message.wz = decision.vx, decision.vy, decision.wz
    message.scanning = decision.scanning
    return message
