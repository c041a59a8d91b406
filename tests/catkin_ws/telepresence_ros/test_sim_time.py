"""A node on a master whose /use_sim_time nobody keeps up: it says so, and when that has changed."""

import subprocess
import sys
import textwrap

import pytest

from telepresence.station.ros_master import master_proxy

pytestmark = pytest.mark.ros

NODE = textwrap.dedent("""
    import sys
    import threading
    from telepresence_ros import sim_time
    from telepresence_ros.node import Node

    sim_time.CLOCK_TIMEOUT = float(sys.argv[1])
    node = Node("worker")
    for thread in threading.enumerate():
        if thread.name == "clock":
            thread.join()
    node.shut_down("the clock runs")
""")
AT_ONCE, NEVER = "0", "300"

CLOCK = textwrap.dedent("""
    import sys
    import rospy
    from rosgraph_msgs.msg import Clock

    rospy.init_node("recording")
    publisher = rospy.Publisher("/clock", Clock, queue_size=1)
    sys.stdin.readline()
    while not rospy.is_shutdown():
        publisher.publish(rospy.Time(5))
        rospy.rostime.wallsleep(0.02)
""")


@pytest.fixture
def start_node(ros_master, run_program, tmp_path):
    """Start a node that ends when it looks no more, and say how to read what it prints."""

    def start(timeout, used=True):
        master_proxy(ros_master["ROS_MASTER_URI"]).setParam("/test", "/use_sim_time", used)
        log = tmp_path / "node.log"
        with log.open("w") as output:
            node = run_program(sys.executable, "-c", NODE, timeout, stdout=output, stderr=subprocess.STDOUT)
        return node, log.read_text

    return start


@pytest.fixture
def recording(ros_master, run_program, wait_until):
    """Who publishes the time, once it is played."""
    master = master_proxy(ros_master["ROS_MASTER_URI"])
    program = run_program(sys.executable, "-c", CLOCK, stdin=subprocess.PIPE)
    wait_until(lambda: dict(master.getSystemState("/test")[2][0]).get("/clock"), "somebody is to give the time")
    return program


def play(recording):
    recording.stdin.write(b"\n")
    recording.stdin.flush()


def test_a_clock_that_nobody_gives_is_mentioned_once(start_node, wait_until):
    node, output = start_node(AT_ONCE)
    wait_until(lambda: "no /clock yet, and nobody publishes it" in output(), "the node says so")
    assert node.poll() is None and "rosparam delete /use_sim_time" in output()


def test_who_does_not_give_it_yet_is_named_and_the_warning_is_taken_back(start_node, recording, wait_until):
    node, output = start_node(AT_ONCE)
    wait_until(lambda: "no /clock yet from /recording" in output(), "the node says whom it waits for")
    assert "has come" not in output()
    play(recording)
    assert node.wait(40) == 0 and output().count("no /clock yet") == output().count("/clock has come") == 1, output()


def test_a_clock_that_comes_in_time_is_not_mentioned(start_node, recording):
    play(recording)
    node, output = start_node(NEVER)
    assert node.wait(40) == 0 and "/clock" not in output(), output()


def test_the_time_of_the_machine_needs_none(start_node):
    node, output = start_node(AT_ONCE, used=False)
    assert node.wait(40) == 0 and "/clock" not in output(), output()
