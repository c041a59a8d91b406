"""A private ROS master for benchmarks, and one bare rospy hop to compare with."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from telepresence.station import processes
from telepresence.station.ros_master import master_answers

sys.path.append(str(Path(__file__).resolve().parents[1] / "lab"))

from free_ports import free_port

MESSAGES = 200
PERIOD = 0.05  # seconds between messages: as often as the driver may command


@contextlib.contextmanager
def private_environment() -> Iterator[dict[str, str]]:
    """Environment with a master URI and a log folder of its own; no master runs yet."""
    with tempfile.TemporaryDirectory(prefix="bench-ros-") as home:
        yield {
            **os.environ,
            "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
            "ROS_HOME": home,
            "ROS_IP": "127.0.0.1",
            "DRIVE_PORT": str(free_port()),
            "TELEPRESENCE_AS_ROOT": "1",
        }


@contextlib.contextmanager
def private_master() -> Iterator[dict[str, str]]:
    with private_environment() as environment:
        uri = environment["ROS_MASTER_URI"]
        master = processes.start(
            ["rosmaster", "--core", "-p", uri.rpartition(":")[2]],
            tied=True,  # else a benchmark that crashes leaves it behind
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            wait_for(lambda: master_answers(uri), "the ROS master")
            yield environment
        finally:
            processes.end(master)


def wait_for(condition, what: str, timeout: float = 60.0) -> None:
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise RuntimeError(f"{what} did not come within {timeout:.0f} s")
        time.sleep(0.01)


def hop_times(environment: dict[str, str]) -> list[float]:
    """Seconds from publish() in one bare rospy node to the callback in another, for a geometry_msgs/Twist."""
    listener = subprocess.Popen(
        [sys.executable, __file__, "listen"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    talker = subprocess.Popen([sys.executable, __file__, "talk"], env=environment, stderr=subprocess.DEVNULL)
    try:
        return [float(listener.stdout.readline()) for _ in range(MESSAGES)]
    finally:
        for process in (talker, listener):
            process.terminate()
            process.wait(10)
        listener.stdout.close()


def main(role: str) -> None:
    import rospy
    from geometry_msgs.msg import Twist

    rospy.init_node(f"hop_{role}")
    if role == "listen":
        rospy.Subscriber(
            "hop",
            Twist,
            lambda message: print(time.monotonic() - message.linear.x, flush=True),
            queue_size=1,
            tcp_nodelay=True,
        )
        rospy.spin()
        return
    publisher = rospy.Publisher("hop", Twist, queue_size=1)
    while not rospy.is_shutdown():
        message = Twist()
        message.linear.x = time.monotonic()
        publisher.publish(message)
        time.sleep(PERIOD)


if __name__ == "__main__":
    main(sys.argv[1])
