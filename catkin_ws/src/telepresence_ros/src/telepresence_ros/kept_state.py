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
    """The node's private parameter `~kept`: switches and texts by name."""

    def __init__(self) -> None:
        self._name = rospy.resolve_name("~kept")
        found = rospy.get_param(self._name, {})
        self._found = found if isinstance(found, dict) else {}
        self._kept: dict[str, bool | str] | None = None

    def switch(self, name: str, otherwise: bool) -> bool:
        """Return a switch of a run of this node that has died; `otherwise` if there is none."""
        value = self._found.get(name)
        return value if isinstance(value, bool) else otherwise

    def text(self, name: str) -> str:
        """Return a text of such a run; empty if there is none."""
        value = self._found.get(name)
        return value if isinstance(value, str) else ""

    def keep(self, values: Mapping[str, bool | str]) -> None:
        """Keep these in place of what was kept before."""
        if values == self._kept:
            return
        self._kept = dict(values)
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
