"""Waits while another program has this node's name: a keyboard that roslaunch starts again gives way.

ROS lets the newer of two nodes with one name throw the older one out. roslaunch would start that again, which would
then throw out the newer one: a person's own teleop_twist_keyboard, or the keyboard of somebody who typed the same line
in another terminal, and so on without end.
"""

from __future__ import annotations

import http.client
import os
import sys
import threading
import xmlrpc.client

import rosgraph
import rospy

from telepresence.station.ros_master import master_proxy

OPTION = "--give-way"
"""Of the command line; launch files have it wherever they have `respawn`."""
PERIOD = 0.5
"""Seconds between two looks."""
ANSWER = 1.0
"""Seconds within which master and namesake must answer."""


def give_way(name: str, stop: threading.Event) -> None:
    """With `OPTION`, wait until no other program answers under the name of this node, and say so once.

    Args:
        name: The node's name, unless the command line gives another.
        stop: Ends the waiting, too.
    """
    if OPTION not in sys.argv:
        return
    own = rospy.names.load_mappings(sys.argv).get("__name", name)
    full = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), own)
    said = False
    while lives(full) and not stop.is_set():
        if not said:
            said = True
            print(f"Another program drives as {full}: the keys of this terminal drive when it has ended.", flush=True)
        stop.wait(PERIOD)


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
