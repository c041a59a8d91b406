"""The safety gate beside a velocity topic, known by the name of its node.

A gate on the pilot's machine publishes on cmd_vel, the name under which programs publish that know no gate. ROS puts
the sender's name on every connection, so a driver can tell them apart.
"""

from __future__ import annotations

import threading
from typing import Any

import rospy
from std_msgs.msg import String

STATES = "safety_state"
"""What every gate publishes, and nobody else."""
FIRST_STATE_TIMEOUT = 1.0
"""Seconds to wait at the start for a gate that the master knows; one that was killed does not answer any more."""


class GateNames:
    """The gates of one namespace; those that have gone count, too. Make one after `rospy.init_node`.

    Args:
        namespace: Of the robot, with its last slash; by default that of this node.
    """

    def __init__(self, namespace: str = "") -> None:
        topic = rospy.resolve_name(f"{namespace}{STATES}")
        self._names: set[str] = set()
        self._heard = threading.Event()
        self._states = rospy.Subscriber(topic, String, self._on_state, queue_size=1)
        if topic in dict(rospy.get_master().getSystemState()[2][0]):
            self._heard.wait(FIRST_STATE_TIMEOUT)

    def __bool__(self) -> bool:
        """Whether there is a gate, or was one."""
        return bool(self._names)

    @property
    def present(self) -> bool:
        """Whether a gate runs now."""
        return self._states.get_num_connections() > 0

    def sent(self, message: Any) -> bool:
        """Return whether a gate has sent this message."""
        return message._connection_header.get("callerid") in self._names

    def _on_state(self, message: String) -> None:
        self._names.add(message._connection_header["callerid"])
        self._heard.set()
