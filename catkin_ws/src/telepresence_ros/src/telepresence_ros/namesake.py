"""Two programs that want one node's name: whoever was thrown out waits until the other has ended.

ROS lets the newer of two nodes with one name throw the older one out. roslaunch would start that again, which would
then throw out the newer one, and so on without end: a launch file that runs twice on one graph, a person's own
teleop_twist_keyboard beside a station's. So a node that roslaunch starts again after it was thrown out gives way.
"""

from __future__ import annotations

import http.client
import os
import sys
import threading
import xmlrpc.client
from pathlib import Path

import rosgraph
import rospy

from telepresence.station.ros_master import master_proxy

OPTION = "--give-way"
"""Option of a node's command line: the node throws nobody out, even when it is started for the first time."""
PERIOD = 0.5
"""Seconds between two looks."""
ANSWER = 1.0
"""Seconds within which master and namesake must answer."""
_THROWN_OUT = "new node registered with same name"
"""rosmaster's reason for the shutdown."""


def give_way(name: str, stop: threading.Event) -> None:
    """Wait until no other program answers under the name of this node, and say so once: with `OPTION`, and when one
    has thrown this node out the last time. Call it before `rospy.init_node`.

    Args:
        name: The node's name, unless the command line gives another.
        stop: Ends the waiting, too.
    """
    mark = _mark()
    if OPTION not in sys.argv and not (mark and mark.exists()):
        return
    own = _mappings().get("__name", name)
    full = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), own)
    said = False
    while lives(full) and not stop.is_set():
        if not said:
            said = True
            print(f"Another program has the name {full}: this one waits until it has ended.", flush=True)
        stop.wait(PERIOD)
    if mark:
        mark.unlink(missing_ok=True)


def remember_to_give_way() -> None:
    """Have it remembered, for the node's next start by roslaunch, when another program throws this one out."""
    mark = _mark()

    def on_shutdown(reason: str) -> None:
        if mark and _THROWN_OUT in reason:
            mark.touch()

    rospy.core.add_preshutdown_hook(on_shutdown)


def lives(full: str) -> bool:
    """Return whether a node of this name (absolute) answers that is not this process."""
    errors = (OSError, http.client.HTTPException, xmlrpc.client.Error)
    try:
        code, _, address = master_proxy(rosgraph.get_master_uri(), ANSWER).lookupNode(full, full)
        if code != 1:
            return False
        code, _, pid = master_proxy(address, ANSWER).getPid(full)
    except errors:  # no master, for which the node waits anyway, or a node that was killed and cannot sign off
        return False
    return code == 1 and pid != os.getpid()


def _mark() -> Path | None:
    """Return the file that says that this node was thrown out; None for one that roslaunch did not start."""
    log = _mappings().get("__log")
    return Path(f"{log}.thrown_out") if log else None


def _mappings() -> dict[str, str]:
    found: dict[str, str] = rosgraph.names.load_mappings(sys.argv)
    return found
