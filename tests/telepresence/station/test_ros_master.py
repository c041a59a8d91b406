"""A node outlives its master, and a roscore that dies comes back with what it knew."""

import signal
import socket
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from telepresence.station import master_keeper, processes
from telepresence.station.faults import SOCKET, FaultListener
from telepresence.station.master_keeper import MasterKeeper
from telepresence.station.ros_master import ended_nodes, forget_nodes, master_answers, master_proxy

pytestmark = pytest.mark.ros

NODE = textwrap.dedent("""
    import rospy, std_msgs.msg, std_srvs.srv, sys
    from telepresence_ros.master_watch import MasterWatch
    rospy.init_node("phoenix")
    publisher = rospy.Publisher("embers", std_msgs.msg.String, queue_size=1)
    rospy.Subscriber("wood", std_msgs.msg.String, lambda message: publisher.publish(message.data + " burnt"))
    rospy.Service("rise", std_srvs.srv.Trigger, lambda request: (True, "risen"))
    patience = float(sys.argv[1])  # for a frozen master; one that has ended is lost at once
    MasterWatch(lambda: print("lost", flush=True), lambda: print("found", flush=True), patience).start()
    print("ready", flush=True)
    rospy.spin()
""")

PROBE = textwrap.dedent("""
    import queue, rospy, std_msgs.msg, std_srvs.srv
    rospy.init_node("probe", anonymous=True)
    answers = queue.SimpleQueue()
    rospy.Subscriber("embers", std_msgs.msg.String, lambda message: answers.put(message.data))
    rospy.wait_for_service("rise", timeout=10)
    print(rospy.ServiceProxy("rise", std_srvs.srv.Trigger)().message)
    publisher = rospy.Publisher("wood", std_msgs.msg.String, queue_size=1)
    for _ in range(100):  # an answer may come before the probe is connected to it
        publisher.publish("oak")
        try:
            print(answers.get(timeout=0.1))
            break
        except queue.Empty:
            continue
""")


LISTENER = textwrap.dedent("""
    import rospy, std_msgs.msg
    rospy.init_node("listener")
    rospy.Subscriber("embers", std_msgs.msg.String, lambda message: None)
    rospy.spin()
""")


def start_node(run_program, patience=60.0):
    node = run_program(sys.executable, "-c", NODE, str(patience), stdout=subprocess.PIPE, text=True)
    assert node.stdout.readline() == "ready\n"
    return node


def pid_of_master(uri):
    """None while none answers; it may end between two questions."""
    try:
        return master_proxy(uri).getPid("/test")[2]
    except OSError:
        return None


def knows(uri, name):
    return master_answers(uri) and master_proxy(uri).lookupNode("/test", name)[0] == 1


def test_a_node_registers_with_a_new_master(ros_environment, run_program, wait_until):
    uri = ros_environment["ROS_MASTER_URI"]
    command = ("rosmaster", "--core", "-p", uri.rpartition(":")[2])
    first = run_program(*command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(lambda: master_answers(uri), "the master answers")
    node = start_node(run_program)

    processes.send(first.pid, signal.SIGSTOP)
    processes.send(first.pid, signal.SIGKILL)
    assert node.stdout.readline() == "lost\n"
    first.wait()
    run_program(*command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    assert node.stdout.readline() == "found\n"

    wait_until(lambda: knows(uri, "/phoenix"), "the new master knows the node")
    answer = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, text=True, timeout=60)
    assert answer.stdout.split("\n")[:2] == ["risen", "oak burnt"], answer.stderr


def test_a_killed_node_is_found_and_forgotten_and_a_frozen_one_stays(ros_master, run_program):
    """Whoever is killed cannot sign off, and the master lists it for ever; a frozen one may go on in a moment."""
    uri = ros_master["ROS_MASTER_URI"]
    killed = start_node(run_program)
    master = master_proxy(uri)
    with socket.create_server(("127.0.0.1", 0)) as listening:  # accepts in the kernel, and nobody ever answers
        address = f"http://127.0.0.1:{listening.getsockname()[1]}"
        master.registerSubscriber("/frozen", "/wood", "std_msgs/String", address)
        processes.send(killed.pid, 9)
        killed.wait()
        assert knows(uri, "/phoenix"), "the master has noticed nothing"

        found = ended_nodes(uri, ["/phoenix", "/frozen", "/nobody"], "/test")
        assert [*found] == ["/phoenix"]
        forget_nodes(uri, found, "/test")
        assert not knows(uri, "/phoenix") and knows(uri, "/frozen")
        listed = {node for group in master.getSystemState("/test")[2] for _, nodes in group for node in nodes}
        assert "/phoenix" not in listed and "/frozen" in listed

        master.registerPublisher("/phoenix", "/embers", "std_msgs/String", address)
        forget_nodes(uri, found, "/test")
        assert knows(uri, "/phoenix"), "one that has come back at another address stays"


def test_a_killed_roscore_comes_back_with_parameters_and_nodes(ros_environment, run_program, wait_until, monkeypatch):
    uri = ros_environment["ROS_MASTER_URI"]
    reports: list[tuple[str, str, str]] = []
    keeper = MasterKeeper(uri, report=lambda *fault: reports.append(fault))
    try:
        master_proxy(uri).setParam("/test", "/robot_description", "<robot/>")
        stranger = run_program("rosrun", "rosout", "rosout", "__name:=stranger", stdout=subprocess.DEVNULL)
        start_node(run_program)
        wait_until(lambda: knows(uri, "/stranger") and knows(uri, "/phoenix"), "both nodes are registered")
        wait_until(lambda: "/stranger" in keeper._nodes, "the keeper has seen them")

        monkeypatch.setattr(master_keeper, "RETURN_TIMEOUT", 60.0)
        processes.send(keeper.pid, signal.SIGKILL)
        wait_until(lambda: keeper.restarts == 1, "roscore is started again")
        wait_until(lambda: knows(uri, "/phoenix"), "our node is registered again")
        assert master_proxy(uri).getParam("/test", "/robot_description")[2] == "<robot/>"

        processes.send(keeper.pid, signal.SIGSTOP)  # while the keeper waits for the node that cannot register again
        wait_until(lambda: keeper.restarts == 2, "a frozen roscore is started again, too")
        assert reports == [("rosmaster", "died: signal 9", "starts again"), ("rosmaster", "froze", "starts again")]
        assert stranger.poll() is None
        wait_until(lambda: knows(uri, "/phoenix"), "our node is registered once more")
        monkeypatch.setattr(master_keeper, "RETURN_TIMEOUT", 0.0)  # from now on: who is still missing
        wait_until(lambda: stranger.poll() is not None, "the node that cannot register again ends, for respawning")

        # What a roslaunch in a terminal does that finds no master: it has the port first.
        start = keeper._start_master
        command = ("rosmaster", "--core", "-p", uri.rpartition(":")[2])

        def start_late() -> None:
            run_program(*command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            wait_until(lambda: master_answers(uri), "somebody else's master answers")
            monkeypatch.undo()
            start()

        monkeypatch.setattr(keeper, "_start_master", start_late)
        processes.send(keeper.pid, signal.SIGKILL)
        wait_until(lambda: pid_of_master(uri) == keeper.pid, "ours is back")
        wait_until(lambda: knows(uri, "/phoenix"), "our node is registered with ours")
    finally:
        keeper.close()
    assert not master_answers(uri)


@pytest.fixture
def core(ros_environment, run_program, wait_until):
    """The master of `./stack up`: its process."""
    port = ros_environment["ROS_MASTER_URI"].rpartition(":")[2]
    core = run_program(sys.executable, "-m", "telepresence_ros.core", "-p", port)
    wait_until(lambda: knows(ros_environment["ROS_MASTER_URI"], "/rosout"), "rosout is registered")
    return core


def master_log(environment):
    return Path(environment["ROS_HOME"], "log", "latest", "master.log").read_text()


def test_the_master_forgets_who_was_killed_once_it_has_something_to_tell_them(
    core, ros_environment, run_program, wait_until
):
    uri = ros_environment["ROS_MASTER_URI"]
    killed, living = start_node(run_program), run_program(sys.executable, "-c", LISTENER, stdout=subprocess.PIPE)
    master = master_proxy(uri)
    wait_until(lambda: knows(uri, "/listener"), "the listener is registered")
    master.subscribeParam("/phoenix", master.lookupNode("/test", "/phoenix")[2], "/heat")
    processes.send(killed.pid, signal.SIGKILL)
    killed.wait()
    master.setParam("/test", "/heat", 451)
    wait_until(lambda: not knows(uri, "/phoenix"), "it is forgotten")

    listed = master.getSystemState("/test")[2]
    assert "/phoenix" not in {node for group in listed for _, nodes in group for node in nodes}
    assert "Traceback" not in master_log(ros_environment)
    assert knows(uri, "/listener") and living.poll() is None

    with socket.create_server(("127.0.0.1", 0)) as listening:
        elsewhere = f"http://127.0.0.2:{listening.getsockname()[1]}"  # refused, and no address of ours for nodes
    master.registerSubscriber("/behind_a_firewall", "/wood", "std_msgs/String", elsewhere)
    master.registerPublisher("/test", "/wood", "std_msgs/String", uri)
    wait_until(lambda: "was not told of /wood" in master_log(ros_environment), "the master could not tell it")
    assert knows(uri, "/behind_a_firewall") and "Traceback" not in master_log(ros_environment)


def test_a_node_that_missed_an_answer_registers_again_with_another_master_only(core, ros_environment, run_program):
    """Else all nodes of a busy machine would register everything, and it would be busier still."""
    node = start_node(run_program, patience=0.0)

    def registrations_after_a_silence() -> int:
        processes.send(core.pid, signal.SIGSTOP)
        assert node.stdout.readline() == "lost\n"
        processes.send(core.pid, signal.SIGCONT)
        assert node.stdout.readline() == "found\n"
        return master_log(ros_environment).count("+SUB [/wood] /phoenix")

    first = registrations_after_a_silence()  # the node may not have asked before, and know no master yet
    assert registrations_after_a_silence() == first


def test_a_frozen_rosout_is_reported_and_starts_again(ros_environment, run_program, wait_until, tmp_path):
    uri = ros_environment["ROS_MASTER_URI"]
    faults = FaultListener(tmp_path / SOCKET)
    port = uri.rpartition(":")[2]
    core = run_program(sys.executable, "-m", "telepresence_ros.core", "-p", port, "--watch", str(tmp_path))
    wait_until(lambda: knows(uri, "/rosout"), "rosout is registered")
    (frozen,) = processes.descendants(core.pid)

    processes.send(frozen, signal.SIGSTOP)
    fault = faults.next(timeout=10.0)
    assert (fault.program, fault.what, fault.next) == ("rosout", "froze", "starts again")
    wait_until(lambda: processes.descendants(core.pid) not in ([], [frozen]), "another one runs")
    faults.close()
