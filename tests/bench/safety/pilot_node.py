"""The node behind `reaction.Pilot`: publishes a velocity twenty times a second, as a program of its own.

    python pilot_node.py TOPIC

Reads lines: "VX VY WZ" [m/s, m/s, rad/s] to publish from now on, "cease" to publish no more, "reset" to reset the
bumper. Answers each with a line: when it last published [s, monotonic], or whether the bumper is reset.
"""

from __future__ import annotations

import sys
import threading
import time

import rospy
from geometry_msgs.msg import Twist
from std_srvs.srv import Trigger


def main(topic: str) -> None:
    rospy.init_node("pilot")
    reset = rospy.ServiceProxy(f"{topic.rpartition('/')[0]}/reset_bumper", Trigger)
    publisher = rospy.Publisher(topic, Twist, queue_size=1, tcp_nodelay=True)
    lock, state = threading.Lock(), {"velocity": None, "last": 0.0}

    def repeat() -> None:
        while not rospy.is_shutdown():
            with lock:
                if state["velocity"] is not None:
                    message = Twist()
                    message.linear.x, message.linear.y, message.angular.z = state["velocity"]
                    state["last"] = time.monotonic()
                    publisher.publish(message)
            time.sleep(0.05)

    threading.Thread(target=repeat, daemon=True).start()
    for line in sys.stdin:
        words = line.split()
        if words == ["reset"]:
            try:
                print(reset().success, flush=True)
            except rospy.ServiceException:
                print(False, flush=True)
            continue
        with lock:
            state["velocity"] = None if words == ["cease"] else [float(word) for word in words]
            print(state["last"], flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
