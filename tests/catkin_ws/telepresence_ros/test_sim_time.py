"""A node on a master whose /use_sim_time nobody keeps up: it says so, once."""

import subprocess
import sys
import textwrap

import pytest

from telepresence.station.ros_master import master_proxy

pytestmark = pytest.mark.ros

NODE = textwrap.dedent("""
    import threading
    from telepresence_ros import sim_time
    from telepresence_ros.node import Node

    sim_time.CLOCK_TIMEOUT = 1.0
    node = Node("worker")
    for thread in threading.enumerate():
        if thread.name == "clock":
            thread.join()
    node.shut_down("it has looked")
""")

CLOCK = textwrap.dedent("""
    import rospy
    from rosgraph_msgs.msg import Clock

    rospy.init_node("recording")
    publisher = rospy.Publisher("/clock", Clock, queue_size=1)
    while not rospy.is_shutdown():
        publisher.publish(rospy.Time(5))
        rospy.rostime.wallsleep(0.02)
""")


@pytest.mark.parametrize(
    ("used", "clock", "warned"),
    [(True, False, 1), (True, True, 0), (False, False, 0)],
    ids=["nobody gives the time", "a recording gives it", "the time of the machine"],
)
def test_a_clock_that_stands_is_mentioned_once(ros_master, run_program, wait_until, used, clock, warned):
    master = master_proxy(ros_master["ROS_MASTER_URI"])
    master.setParam("/test", "/use_sim_time", used)
    if clock:
        run_program(sys.executable, "-c", CLOCK)
        wait_until(lambda: dict(master.getSystemState("/test")[2][0]).get("/clock"), "somebody gives the time")
    node = run_program(sys.executable, "-c", NODE, stderr=subprocess.PIPE, text=True)
    _, errors = node.communicate(timeout=20)
    assert node.returncode == 0, errors
    assert errors.count("nobody publishes /clock") == warned, errors
