"""The node `station_faults`: tells the station what died or froze. Argument: the path of its socket.

Publishes: /station/faults (telepresence_msgs/Fault, latched), one message for each fault that our roslaunch or
           `./stack up` has noticed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import rospy
from telepresence_msgs.msg import Fault

from telepresence.station import heartbeat
from telepresence.station.faults import FaultListener
from telepresence_ros.node import Node

TOPIC = "/station/faults"
PERIOD = 0.1
"""Seconds between two beats at most."""


def main() -> int:
    """Run the node; the exit code."""
    listener = FaultListener(Path(rospy.myargv(sys.argv)[1]))
    node = Node("station_faults")
    publisher = rospy.Publisher(TOPIC, Fault, queue_size=50, latch=True)

    def publish() -> None:
        while not node.stop.is_set():
            heartbeat.beat()
            fault = listener.next(PERIOD)
            if fault is not None:
                publisher.publish(rospy.Time.from_sec(fault.stamp), fault.program, fault.what, fault.next)

    node.at_end(listener.close)
    return node.run(publish)
