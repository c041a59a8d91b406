"""A ROS node that prints, every five seconds, how far both robots have driven [m] by their odometry."""

import math
import sys
import time

import rospy
from nav_msgs.msg import Odometry
from telepresence_ros.node import Node

TOPICS = ("/odom", "/rto3/odom")
STEP = 0.02
"""[m]; shorter ways are noise."""
JUMP = 1.0
"""[m]; a robot that was started again stands elsewhere."""


def main() -> int:
    node = Node("soak_odometer")
    driven = dict.fromkeys(TOPICS, 0.0)
    last: dict[str, tuple[float, float]] = {}

    def on_odometry(message: Odometry, topic: str) -> None:
        place = message.pose.pose.position.x, message.pose.pose.position.y
        way = math.dist(place, last.setdefault(topic, place))
        if way > STEP:
            last[topic] = place
            driven[topic] += way if way < JUMP else 0.0

    for topic in TOPICS:
        rospy.Subscriber(topic, Odometry, on_odometry, callback_args=topic, queue_size=1)

    def tell() -> None:
        while not node.stop.wait(5.0):
            print(time.time(), *driven.values(), flush=True)

    return node.run(tell)


if __name__ == "__main__":
    sys.exit(main())
