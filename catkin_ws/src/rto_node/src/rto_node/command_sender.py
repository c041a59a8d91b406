"""What rto_node sends to the robot: digital outputs and velocities, none of them late. No ROS topics."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import rospy

from rto_node.client import RobotinoClient
from rto_node.command_watchdog import CommandWatchdog
from rto_node.link import Link

OUTPUTS_TIMEOUT = 0.5
"""Seconds for which digital outputs are tried to be set, as long as a velocity counts: they move grippers and valves,
which must not happen minutes later, when a robot that was switched off is back."""

VELOCITY = "velocity"


class Sent(NamedTuple):
    """`reason` is what was decided, for people; `reached`: the robot took the velocity, or none was due."""

    reason: str
    reached: bool


class CommandSender:
    """Sends over one link. `set_outputs` may be called from another thread.

    Args:
        link: To the robot; its problem says why something did not reach it.
        watchdog: Knows the velocity that counts.
        clock: Monotonic time [s], that of the watchdog's commands.
    """

    def __init__(self, link: Link, watchdog: CommandWatchdog, clock: Callable[[], float] = time.monotonic) -> None:
        self._link, self._watchdog, self._clock = link, watchdog, clock
        self._outputs: tuple[tuple[bool, ...], float] | None = None

    def set_outputs(self, values: tuple[bool, ...]) -> None:
        """Set the eight outputs with the next `send`, or not at all when that takes too long."""
        self._outputs = values, self._clock() + OUTPUTS_TIMEOUT

    def send(self, master_alive: bool = True) -> Sent:
        """Send what waits, and the velocity that counts then; takes as long as the robot does."""
        self._send_outputs()
        # Only now: a robot may take half a second to set outputs, and the velocity has grown older meanwhile.
        command = self._watchdog.decide(self._clock(), master_alive)
        reached = True
        if (velocity := command.velocity) is not None:
            reached = self._link.ask(lambda client: client.drive(*velocity), VELOCITY)
        refusal = self._link.refusal(VELOCITY) if not reached and not self._link.lost else ""
        return Sent(f"stopped: {refusal}" if refusal else command.reason, reached)

    def _send_outputs(self) -> None:
        waiting = self._outputs
        if waiting is None:
            return
        values, deadline = waiting
        left = deadline - self._clock()

        def set_them(client: RobotinoClient) -> None:
            client.set_digital_outputs(values, left)

        done = left > 0.0 and self._link.ask(set_them, "digital outputs")
        late = not done and self._clock() >= deadline
        if late:
            rospy.logwarn("the digital outputs were not set within %g s and are dropped", OUTPUTS_TIMEOUT)
        if (done or late) and self._outputs is waiting:
            self._outputs = None
