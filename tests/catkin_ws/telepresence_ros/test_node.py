"""The base of our nodes: waits for a master, runs loops, and ends in order."""

import signal
import subprocess
import sys
import textwrap

import pytest
from private_master import start_master
from telepresence_ros.logs import OF_EACH_LINE

from telepresence.station import processes
from telepresence.station.ros_master import master_proxy

pytestmark = pytest.mark.ros

NODE = textwrap.dedent("""
    import sys, threading, rospy, std_msgs.msg
    from telepresence_ros.node import Node, stop_on_signals

    def say(text):
        print(text, flush=True)

    node = Node("worker", master_timeout=0.2)
    node.at_end(lambda: say("released"))

    def work():
        for _ in node.cycles(0.01):
            pass
        say("ROS still works" if not rospy.is_shutdown() else "too late")

    def watch():
        say("running")
        node.stop.wait()

    def fail():
        raise RuntimeError("a part is broken")

    def finish():
        return None

    loops = {"work": (work, watch), "fail": (work, fail), "finish": (work, finish)}[sys.argv[1]]
    sys.exit(node.run(*loops))
""")

LATE = textwrap.dedent("""
    import sys, threading, rospy
    from telepresence_ros.node import hide_late_publications
    rospy.init_node("late")
    hide_late_publications()

    def publish():
        raise rospy.ROSException("publish() to a closed topic")

    def publish_late(_reason):
        print("shut down" if rospy.is_shutdown() else "not yet shut down", flush=True)
        thread = threading.Thread(target=publish)
        thread.start()
        thread.join()

    publish_late("") if sys.argv[1] == "early" else rospy.core.add_preshutdown_hook(publish_late)
    rospy.signal_shutdown("the test")
""")

KEYS = textwrap.dedent("""
    import threading, rospy
    from telepresence_ros.node import Node, stop_on_signals
    node = Node("keys", stop=stop_on_signals(threading.Event()))
    print("running", flush=True)
    node.stop.wait()
    print("a last word" if not rospy.is_shutdown() else "too late", flush=True)
    node.shut_down("the keys were let go")
""")


LOGS = textwrap.dedent("""
    import sys, rospy
    from telepresence_ros.node import Node
    node = Node("logs")
    print("running", flush=True)
    for line in sys.stdin:
        rospy.logwarn(line.strip())
        print("without topics" if rospy.get_param_cached("/rosout_disable_topics_generation") else "logged", flush=True)
    node.shut_down("no more lines")
""")


@pytest.fixture
def start(run_program):
    def start(program, *words):
        pipe = subprocess.PIPE
        return run_program(sys.executable, "-c", program, *words, stdin=pipe, stdout=pipe, stderr=pipe, text=True)

    return start


def test_ctrl_c_lets_the_loops_end_while_ros_works(ros_master, start):
    node = start(NODE, "work")
    assert node.stdout.readline() == "running\n"
    processes.send(node.pid, signal.SIGINT)
    output, _ = node.communicate(timeout=20)
    assert output.split("\n") == ["ROS still works", "released", ""]
    assert node.returncode == 0
    known = master_proxy(ros_master["ROS_MASTER_URI"]).lookupNode("/test", "/worker")[0]
    assert known != 1, "a node that has ended does not stay registered"


@pytest.mark.parametrize(("how", "code"), [("fail", 1), ("finish", 0)])
def test_a_loop_that_ends_ends_the_node(ros_master, start, how, code):
    node = start(NODE, how)
    output, errors = node.communicate(timeout=20)
    assert output.split("\n") == ["ROS still works", "released", ""]
    assert node.returncode == code
    assert ("a part is broken" in errors) is (how == "fail")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_node_that_reads_keys_has_a_last_word(ros_master, start, number):
    node = start(KEYS)
    assert node.stdout.readline() == "running\n"
    processes.send(node.pid, number)
    output, _ = node.communicate(timeout=20)
    assert output == "a last word\n" and node.returncode == 0


def test_without_a_master_it_says_so_and_gives_up(ros_environment, start):
    node = start(NODE, "work")
    output, errors = node.communicate(timeout=20)
    assert node.returncode == 1 and output == ""
    assert "No ROS master answered at " + ros_environment["ROS_MASTER_URI"] in errors


@pytest.fixture
def say(request, start, run_program, ros_environment, wait_until):
    """Have a node log a line; what it answers."""
    master = start_master(ros_environment["ROS_MASTER_URI"], run_program, wait_until)
    for parameter in getattr(request, "param", ()):
        master_proxy(ros_environment["ROS_MASTER_URI"]).setParam("/test", parameter, True)
    node = start(LOGS)
    assert node.stdout.readline() == "running\n"

    def say():
        print("a line", file=node.stdin, flush=True)
        return node.stdout.readline().strip()

    say.master = master
    yield say
    processes.send(master.pid, signal.SIGCONT)
    node.communicate(timeout=20)


@pytest.mark.timeout(60)  # else the node waits for as long as the master is frozen
def test_a_line_is_logged_while_the_master_is_frozen(say):
    processes.send(say.master.pid, signal.SIGSTOP)
    assert say() == "logged"


@pytest.mark.parametrize("say", [[OF_EACH_LINE]], indirect=True)
def test_what_somebody_has_set_for_all_lines_counts(say):
    assert say() == "without topics"


@pytest.mark.parametrize(("when", "shown"), [("late", False), ("early", True)])
def test_only_what_is_published_while_rospy_shuts_down_is_hidden(ros_master, when, shown):
    program = [sys.executable, "-c", LATE, when]
    ended = subprocess.run(program, capture_output=True, text=True, timeout=30)
    assert ended.stdout == "not yet shut down\n" and ended.returncode == 0
    assert ("closed topic" in ended.stderr) is shown
