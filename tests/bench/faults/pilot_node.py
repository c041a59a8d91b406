"""A program that drives by topic, 20 times a second: `python pilot_node.py TOPIC`, commanded over standard input.

hold VX WZ   publish this velocity [m/s, rad/s] from now on
release      publish zeros for 0.3 s, as our own programs do, then nothing
restart      bring the simulated world back to its start; answers "done", or "failed" and why
"""

from __future__ import annotations

import os
import sys
import threading
import time

import rospy
from geometry_msgs.msg import Twist
from std_srvs.srv import Trigger
from telepresence_ros.master_watch import MasterWatch, wait_for_master

from telepresence.teleop.command_timeout import ZEROS_TIME

PERIOD = 0.05
SERVICE_TIMEOUT = 3.0
START_TIMEOUT = 30.0


class Pilot:
    """Publishes what is held."""

    def __init__(self, topic: str) -> None:
        self._publisher = rospy.Publisher(topic, Twist, queue_size=1, tcp_nodelay=True)
        self._velocity = (0.0, 0.0)
        self._until = 0.0
        threading.Thread(target=self._run, name="pilot", daemon=True).start()

    def hold(self, vx: float, wz: float) -> None:
        self._velocity, self._until = (vx, wz), float("inf")

    def release(self) -> None:
        self._velocity, self._until = (0.0, 0.0), time.monotonic() + ZEROS_TIME

    def _run(self) -> None:
        due = time.monotonic()
        while True:
            due = max(due + PERIOD, time.monotonic())
            if due < self._until:
                message = Twist()
                message.linear.x, message.angular.z = self._velocity
                self._publisher.publish(message)
            time.sleep(max(0.0, due - time.monotonic()))


def restart() -> str:
    try:
        rospy.wait_for_service("/restart_simulation", SERVICE_TIMEOUT)
        rospy.ServiceProxy("/restart_simulation", Trigger)()
    except (rospy.ROSException, rospy.ServiceException) as error:
        return f"failed {error}"
    return "done"


def main(topic: str) -> None:
    wait_for_master(START_TIMEOUT)
    rospy.init_node("bench_pilot", anonymous=True, disable_signals=True)
    pilot = Pilot(topic)
    MasterWatch().start()
    print("ready", flush=True)
    for line in sys.stdin:
        word, *numbers = line.split()
        if word == "hold":
            pilot.hold(*map(float, numbers))
        elif word == "release":
            pilot.release()
        elif word == "restart":
            print(restart(), flush=True)
    os._exit(0)  # rospy would say good-bye to a master that may be gone


if __name__ == "__main__":
    main(sys.argv[1])
