"""Reports the state of a node on /diagnostics."""

from __future__ import annotations

from collections.abc import Mapping

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from telepresence.security.outside_text import LONGEST_LOG, clean

OK, WARN, ERROR, STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE


class Diagnostics:
    """Publishes the status of one part at most once a second.

    Args:
        name: The part, shown as `<node>: <name>`.
        hardware_id: The robot's address.
    """

    def __init__(self, name: str, hardware_id: str) -> None:
        self._name = f"{rospy.get_name().strip('/')}: {name}"
        self._hardware_id = hardware_id
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._due = 0.0

    def report(self, now: float, level: int, message: str, values: Mapping[str, object] | None = None) -> bool:
        """Publish, if a second has passed since the last time. `now` [s] is any clock that does not jump."""
        if now < self._due:
            return False
        self._due = now + 1.0
        status = DiagnosticStatus(level, self._name, clean(message, LONGEST_LOG), self._hardware_id, [])
        status.values = [KeyValue(key, clean(value, LONGEST_LOG)) for key, value in (values or {}).items()]
        message_array = DiagnosticArray(status=[status])
        message_array.header.stamp = rospy.Time.now()
        self._publisher.publish(message_array)
        return True
