"""A subscriber that is told of a publisher again and again before it has connected, or late; a real ROS graph."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap

import pytest

from telepresence.station import processes

pytestmark = pytest.mark.ros

UPDATES = 20
PUBLISHER = textwrap.dedent("""
    import rospy
    from std_msgs.msg import String
    rospy.init_node("publisher")
    publisher = rospy.Publisher("words", String, queue_size=1, latch=True)
    publisher.publish("a word")
    print(rospy.get_node_uri(), flush=True)
    rospy.spin()
""")
HIDDEN_PUBLISHER = PUBLISHER.replace(
    "rospy.spin()",
    """rosgraph.Master("publisher").unregisterPublisher("/words", rospy.get_node_uri())
print("hidden", flush=True)
rospy.spin()""",
).replace("import rospy", "import rosgraph, rospy")
"""The master does not know it, so a subscriber knows what the test tells it, and nothing else."""
SUBSCRIBER = textwrap.dedent(f"""
    import sys, threading, xmlrpc.client
    import rospy
    from rospy.impl.registration import RegManager, get_registration_listeners
    from std_msgs.msg import String
    from telepresence_ros.node import Node

    Node("subscriber")
    heard = threading.Event()
    words = rospy.Subscriber("words", String, lambda message: heard.set())
    manager, = (listener for listener in get_registration_listeners().listeners if isinstance(listener, RegManager))
    opened = []
    add = words.impl.add_connection
    words.impl.add_connection = lambda connection: opened.append(connection) or add(connection)
    me = xmlrpc.client.ServerProxy(rospy.get_node_uri())
    for _ in range({UPDATES}):
        me.publisherUpdate("/master", "/words", [sys.argv[1]])
    while manager.updates:
        rospy.rostime.wallsleep(0.01)
    targets = [getattr(thread, "_target", None) for thread in threading.enumerate()]
    print("told", sum(getattr(target, "__name__", "") == "_connect_topic_thread" for target in targets), flush=True)
    sys.stdin.readline()
    print(heard.wait(10), len(opened), flush=True)
""")


def test_a_publisher_that_is_told_of_again_is_connected_to_once(ros_master, run_program):
    publisher = run_program(sys.executable, "-c", PUBLISHER, stdout=subprocess.PIPE, text=True)
    uri = publisher.stdout.readline().strip()
    processes.send(publisher.pid, signal.SIGSTOP)  # it answers late: all threads ask before one has connected
    subscriber = run_program(
        sys.executable, "-c", SUBSCRIBER, uri, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    threads = int(subscriber.stdout.readline().removeprefix("told"))
    assert 1 <= threads < UPDATES / 2, "most of them had nothing to do"
    processes.send(publisher.pid, signal.SIGCONT)
    subscriber.stdin.write("\n")
    subscriber.stdin.flush()
    assert subscriber.stdout.readline() == "True 1\n"


OVERTAKEN = textwrap.dedent("""
    import sys, threading
    import rospy
    from rospy.impl.registration import RegManager, get_registration_listeners
    from std_msgs.msg import String
    from telepresence_ros.node import Node

    Node("subscriber")
    heard = threading.Event()
    words = rospy.Subscriber("words", String, lambda message: heard.set())
    manager, = (listener for listener in get_registration_listeners().listeners if isinstance(listener, RegManager))
    with manager.cond:  # rospy's thread looks when both have come
        manager.publisher_update("/words", [sys.argv[1]])
        manager.publisher_update("/words", [])
    print(heard.wait(10), flush=True)
""")


def test_a_publisher_is_not_lost_when_an_older_answer_comes_later(ros_master, run_program):
    publisher = run_program(sys.executable, "-c", HIDDEN_PUBLISHER, stdout=subprocess.PIPE, text=True)
    uri = publisher.stdout.readline().strip()
    assert publisher.stdout.readline() == "hidden\n"
    subscriber = run_program(sys.executable, "-c", OVERTAKEN, uri, stdout=subprocess.PIPE, text=True)
    assert subscriber.stdout.readline() == "True\n"
