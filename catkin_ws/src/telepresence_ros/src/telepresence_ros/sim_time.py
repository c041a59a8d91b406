"""A warning about /use_sim_time on a master where nobody publishes /clock: ROS's time then stands at zero.

A recording that was played, or a simulator that has ended, leaves the parameter behind on a master that goes on. Every
stamp is 0 from then on, transforms are never found, and nothing says why.
"""

from __future__ import annotations

import threading

import rospy

CLOCK_TIMEOUT = 2.0
"""Seconds of real time within which the first /clock must come."""


def warn_without_clock(stop: threading.Event) -> None:
    """Look once, on a thread of its own, unless `stop` is set before. Call it after `rospy.init_node`."""
    if rospy.rostime.is_wallclock():
        return

    def look() -> None:
        if not stop.wait(CLOCK_TIMEOUT) and rospy.get_rostime().is_zero():
            rospy.logwarn(
                "/use_sim_time is set and nobody publishes /clock: every stamp is 0. Without a recording or a "
                "simulator that gives the time:  rosparam delete /use_sim_time  and start the nodes anew"
            )

    threading.Thread(target=look, name="clock", daemon=True).start()
