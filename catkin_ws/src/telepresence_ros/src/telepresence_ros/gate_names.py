"""The safety gate beside a velocity topic, known by the name of its node.

A gate on the pilot's machine publishes on cmd_vel, the name under which programs publish that know no gate. ROS puts
the sender's name on every connection, so a driver can tell them apart.
"""

from __future__ import annotations

import threading
import time
from typing import Any

import rosgraph
import rospy
from std_msgs.msg import String

from telepresence.station.ros_master import topics_of

STATES, VELOCITIES = "safety_state", "cmd_vel"
FIRST_STATE_TIMEOUT = 1.0
"""Seconds to wait at the start for a gate that the master knows; one that was killed does not answer any more."""
MASTER_TIMEOUT = 1.0
"""Seconds within which the master must answer."""
LOOK_PERIOD = 1.0
"""Seconds between two looks whether a node is a gate."""


class GateNames:
    """The gates of one namespace; those that have gone count, too. Make one after `rospy.init_node`.

    A gate publishes safety_state, and hears the cmd_vel on which it publishes: what plays a recording of a gate back
    publishes the same, and hears nothing.

    Args:
        namespace: Of the robot, with its last slash; by default that of this node.
        wait: For a gate that runs already, so that it is known from the first velocity on.
    """

    def __init__(self, namespace: str = "", wait: bool = True) -> None:
        topic, self._velocities = (rospy.resolve_name(f"{namespace}{name}") for name in (STATES, VELOCITIES))
        self._names: set[str] = set()
        self._looked: dict[str, float] = {}
        self._heard = threading.Event()
        self._states = rospy.Subscriber(topic, String, self._on_state, queue_size=1)
        graph = self._ask_master() if wait else None
        if graph is not None and topic in graph[0]:
            self._heard.wait(FIRST_STATE_TIMEOUT)

    def __bool__(self) -> bool:
        """Whether there is a gate, or was one."""
        return bool(self._names)

    @property
    def present(self) -> bool:
        """Whether a gate runs now."""
        # rospy's public interface gives only the number of connections.
        connections = self._states.impl.connections or ()
        return any(connection.header.get("callerid") in self._names for connection in connections)

    def sent(self, message: Any) -> bool:
        """Return whether a gate has sent this message."""
        return message._connection_header.get("callerid") in self._names

    def _on_state(self, message: String) -> None:
        name, now = message._connection_header["callerid"], time.monotonic()
        if name in self._names or now < self._looked.get(name, now):
            return
        self._looked[name] = now + LOOK_PERIOD
        if self._is_gate(name):
            self._names.add(name)
            self._heard.set()

    def _is_gate(self, name: str) -> bool:
        graph = self._ask_master()
        return graph is not None and all(name in nodes.get(self._velocities, ()) for nodes in graph)

    @staticmethod
    def _ask_master() -> tuple[dict[str, list[str]], dict[str, list[str]]] | None:
        return topics_of(rosgraph.get_master_uri(), rospy.get_name(), MASTER_TIMEOUT)
