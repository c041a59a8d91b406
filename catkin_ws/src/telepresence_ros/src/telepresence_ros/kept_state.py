"""What people have set in a node, kept on the ROS master for as long as the node runs.

A node that dies and is started again goes on with it: a microphone that was muted stays muted. One that ends forgets
it, so the next session begins as its parameters say.
"""

from __future__ import annotations

import http.client
import xmlrpc.client
from collections.abc import Mapping
from typing import Any

import rosgraph
import rospy

from telepresence.station.ros_master import master_proxy

TIMEOUT = 1.0
"""Seconds that the master may take for an answer."""
ERRORS = (OSError, http.client.HTTPException, xmlrpc.client.Error)


class KeptState:
    """The node's private parameter `~kept`: switches by name."""

    def __init__(self) -> None:
        self._name = rospy.resolve_name("~kept")
        self._kept: dict[str, bool] | None = None

    def read(self) -> dict[str, bool]:
        """Return what was kept of a run of this node that has died; empty if there was none."""
        found = rospy.get_param(self._name, {})
        if not isinstance(found, dict):
            return {}
        return {str(name): value for name, value in found.items() if isinstance(value, bool)}

    def keep(self, switches: Mapping[str, bool]) -> None:
        """Keep these in place of what was kept before."""
        if switches == self._kept:
            return
        self._kept = dict(switches)
        try:
            self._master().setParam(rospy.get_name(), self._name, self._kept)
        except ERRORS as error:
            rospy.logwarn(
                "what was set here is lost if this node dies, since the ROS master does not take it: %s", error
            )

    def forget(self) -> None:
        """Keep nothing. A master that has gone keeps nothing either."""
        try:
            self._master().deleteParam(rospy.get_name(), self._name)
        except ERRORS as error:
            rospy.logdebug("%s was not deleted: %s", self._name, error)

    def _master(self) -> Any:  # XML-RPC has no types
        return master_proxy(rosgraph.get_master_uri(), TIMEOUT)
