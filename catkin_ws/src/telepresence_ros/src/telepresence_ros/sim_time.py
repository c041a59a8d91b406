"""A warning about /use_sim_time on a master where no /clock comes: ROS's time then stands at zero.

A recording that was played, or a simulator that has ended, leaves the parameter behind on a master that goes on. Every
stamp is 0 from then on, transforms are never found, and nothing says why. But it may also be that the recording is yet
to be played.
"""

from __future__ import annotations

import threading
import time

import rosgraph
import rospy

from telepresence.station.ros_master import topics_of

CLOCK_TIMEOUT = 2.0
"""Seconds of real time without a /clock after which the node says so."""
LOOK_PERIOD = 0.2
"""Seconds between two looks whether it has come."""
ADVICE = "If nothing is to give the time:  rosparam delete /use_sim_time  and start the nodes anew"


def warn_without_clock(stop: threading.Event) -> None:
    """Watch for the first /clock, on a thread of its own, until `stop` is set. Call it after `rospy.init_node`."""
    if not rospy.rostime.is_wallclock():
        threading.Thread(target=_watch, args=(stop,), name="clock", daemon=True).start()


def _watch(stop: threading.Event) -> None:
    due, warned = time.monotonic() + CLOCK_TIMEOUT, False
    while rospy.get_rostime().is_zero():
        if not warned and time.monotonic() >= due:
            rospy.logwarn("/use_sim_time is set and there is no /clock yet%s: every stamp is 0. %s", _givers(), ADVICE)
            warned = True
        if stop.wait(LOOK_PERIOD):
            return
    if warned:
        rospy.loginfo("/clock has come: stamps are right from now on")


def _givers() -> str:
    """Who is to give the time, in words, as far as the master knows and answers."""
    graph = topics_of(rosgraph.get_master_uri(), rospy.get_name())
    if graph is None:
        return ""
    names = graph[0].get("/clock")
    return f" from {', '.join(names)}" if names else ", and nobody publishes it"
