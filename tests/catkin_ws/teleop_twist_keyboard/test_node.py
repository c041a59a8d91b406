"""The keyboard node on a real ROS graph, in a real terminal."""

import os
import signal
import subprocess
import sys
import textwrap
import xmlrpc.client
from pathlib import Path

import pytest

from telepresence.station import processes
from telepresence.station.ros_master import master_answers

pytestmark = pytest.mark.ros

GUIDES_RUN = ("rosrun", "teleop_twist_keyboard", "teleop_twist_keyboard.py")
RUN = (str(Path(__file__).parents[3] / "catkin_ws/devel/lib/teleop_twist_keyboard/teleop_twist_keyboard.py"),)
"""The same without rosrun, which takes a second to find it."""
REPORTS_RUN = ("rosrun", "telepresence_1", "teleop_twist_keyboard.py")
LAUNCH = ("roslaunch", "teleop_twist_keyboard", "teleop.launch")

OTHER_INPUT = textwrap.dedent("""
    import rospy
    from geometry_msgs.msg import Twist
    rospy.init_node("other_input")
    publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    while publisher.get_num_connections() < 2 and not rospy.is_shutdown():
        rospy.sleep(0.02)
    publisher.publish(Twist())
    print("sent", flush=True)
    rospy.spin()
""")


def start(open_terminal, wait_until, listener, *argv):
    """Start the node in a terminal, and press a first key that the listener has received."""
    terminal = open_terminal(*argv)
    wait_until(lambda: "currently:" in terminal.seen, "the help is printed")

    def press():
        if not listener.heard:
            terminal.type("i")
        return listener.heard

    wait_until(press, "the listener hears the node")
    return terminal


def test_without_a_terminal_it_lives_and_publishes_nothing(ros_master, run_program, listener):
    node = run_program(*GUIDES_RUN, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
    assert "no terminal" in node.stdout.readline()
    assert "roslaunch teleop_twist_keyboard" in node.stdout.readline()
    processes.send(node.pid, signal.SIGINT)
    assert node.wait(10) == 0
    assert node.stdout.read() == ""
    assert listener.heard == []


def test_the_help_comes_again_after_fifteen_speed_keys_as_in_the_report(open_terminal, wait_until, listener):
    """Under the report's own name for the program."""
    terminal = start(open_terminal, wait_until, listener, *REPORTS_RUN)
    assert "currently:\tspeed 0.2\tturn 0.5\r\n" in terminal.seen
    terminal.type("q" * 8 + "z" * 6)
    wait_until(lambda: "speed 0.228\tturn 0.57\r\n" in terminal.seen, "the speeds are printed")
    assert terminal.seen.count("Moving around:") == 1
    terminal.type("k")
    terminal.type("w")
    wait_until(lambda: terminal.seen.count("Moving around:") == 2, "the help is printed again")


def test_it_hears_others_drive_and_not_itself(open_terminal, wait_until, listener, run_program):
    start(open_terminal, wait_until, listener, *RUN)
    run_program(sys.executable, "-c", OTHER_INPUT)
    master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    keyboard = master.lookupNode("/test", "/teleop_twist_keyboard")[2]

    def heard() -> set[str]:
        links = xmlrpc.client.ServerProxy(keyboard).getBusInfo("/test")[2]
        return {uri for _, uri, direction, _, topic, *_ in links if (direction, topic) == ("i", "/cmd_vel")}

    wait_until(heard, "it is connected to the other program")
    assert keyboard not in heard()


def test_hanging_up_stops_the_robot(open_terminal, wait_until, listener):
    terminal = start(open_terminal, wait_until, listener, *RUN)
    terminal.hang_up()
    assert terminal.process.wait(10) == 0
    wait_until(lambda: listener.heard[-1].is_zero, "the last command is zero")


@pytest.mark.parametrize("request_", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_the_robot_and_restores_the_terminal(open_terminal, wait_until, listener, request_):
    terminal = start(open_terminal, wait_until, listener, *RUN)
    terminal.process.send_signal(request_)
    assert terminal.process.wait(10) == 0
    wait_until(lambda: listener.heard[-1].is_zero, "the last command is zero")
    assert terminal.echoes() and terminal.takes_lines()


def test_rosnode_kill_stops_the_robot(open_terminal, wait_until, listener):
    terminal = start(open_terminal, wait_until, listener, *RUN)
    subprocess.run(["rosnode", "kill", "/teleop_twist_keyboard"], check=True, capture_output=True, timeout=20)
    assert terminal.process.wait(10) == 0
    wait_until(lambda: listener.heard[-1].is_zero, "the last command is zero")


def test_a_lost_master_stops_the_robot_until_a_new_key(open_terminal, wait_until, ros_environment, run_program, listen):
    uri = ros_environment["ROS_MASTER_URI"]
    command = ("rosmaster", "--core", "-p", uri.rpartition(":")[2])
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    master = run_program(*command, **quiet)
    wait_until(lambda: master_answers(uri), "the master answers")
    listener = listen()
    terminal = start(open_terminal, wait_until, listener, *RUN)

    processes.send(master.pid, signal.SIGKILL)
    master.wait()
    wait_until(lambda: listener.heard[-1].is_zero, "the robot is stopped")
    wait_until(lambda: "The ROS master does not answer" in terminal.seen, "the person learns why")

    run_program(*command, **quiet)
    wait_until(lambda: master_answers(uri), "a new master answers")
    assert listener.heard[-1].is_zero
    terminal.type("j")
    wait_until(lambda: listener.heard[-1].wz == 0.5, "a new key drives")


def test_another_input_takes_over(open_terminal, wait_until, listener, run_program):
    terminal = start(open_terminal, wait_until, listener, *RUN)
    other = run_program(sys.executable, "-c", OTHER_INPUT, stdout=subprocess.PIPE, text=True)
    assert other.stdout.readline() == "sent\n"
    wait_until(lambda: "Another input drives now" in terminal.seen, "the keyboard lets go")
    terminal.type("l")
    wait_until(lambda: listener.heard[-1].wz == -0.5, "a key takes over again")


def test_a_job_that_is_put_aside_stops_the_robot_and_leaves_the_keys_to_the_shell(open_terminal, wait_until, listener):
    shell = open_terminal("bash", "--noprofile", "--norc", "-i")
    shell.type(" ".join(LAUNCH) + "\n")
    wait_until(lambda: "currently:" in shell.seen, "the help is printed")
    shell.type("i")
    wait_until(lambda: listener.heard, "the robot drives")

    shell.type("\x1a")
    wait_until(lambda: "Stopped" in shell.seen, "the shell has put the job aside")
    wait_until(lambda: listener.heard[-1].is_zero, "the robot stops")
    shell.type("echo $((6*7)) ijl\n")
    wait_until(lambda: "42 ijl\r\n" in shell.seen, "the shell gets every key")
    assert listener.heard[-1].is_zero

    shell.type("fg\n")
    wait_until(lambda: "keys drive again" in shell.seen, "the node has the terminal again")
    assert listener.heard[-1].is_zero
    shell.type("j")
    wait_until(lambda: listener.heard[-1].wz == 0.5, "keys drive again")
    shell.type("\x03")
    wait_until(lambda: "done" in shell.seen, "roslaunch has ended")
    shell.type("exit\n")
    shell.process.wait(10)


def test_waits_for_a_master_and_says_so(ros_environment, open_terminal, wait_until):
    terminal = open_terminal(*RUN)
    wait_until(
        lambda: "No ROS master answers" in terminal.seen and "roscore" in terminal.seen, "it says what is missing"
    )
    terminal.type("\x03")
    assert terminal.process.wait(10) == 0


def test_a_wrong_parameter_is_named(ros_master):
    ended = subprocess.run([*RUN, "_speed:=-1"], capture_output=True, text=True, timeout=30)
    assert ended.returncode == 1
    assert "speed must be above 0" in ended.stderr


OWN_KEYBOARD = textwrap.dedent("""
    import rospy
    from geometry_msgs.msg import Twist
    rospy.init_node("teleop_twist_keyboard")
    publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    print("runs", flush=True)
    rospy.spin()
    print("ended", flush=True)
""")
"""What a person's own teleop_twist_keyboard is to ROS."""


def test_a_stations_keyboard_gives_way_to_a_persons_own_of_the_same_name(
    ros_master, open_terminal, wait_until, listener, run_program
):
    """It waits, throws nobody out, and drives when the other one has ended."""
    own = run_program(sys.executable, "-c", OWN_KEYBOARD, stdout=subprocess.PIPE, text=True)
    assert own.stdout.readline() == "runs\n"
    terminal = open_terminal(*RUN, "--give-way")
    wait_until(lambda: "Another program has the name /teleop_twist_keyboard" in terminal.seen, "it gives way")
    assert own.poll() is None and "currently:" not in terminal.seen
    processes.send(own.pid, signal.SIGTERM)
    assert own.wait(10) == 0
    wait_until(lambda: "currently:" in terminal.seen, "it drives")
    terminal.type("j")
    wait_until(lambda: listener.heard and listener.heard[-1].wz == 0.5, "a key drives")


def test_the_same_line_in_two_terminals_drives_from_the_newer_one_until_that_ends(
    ros_master, open_terminal, wait_until, listener
):
    older = open_terminal(*LAUNCH)
    wait_until(lambda: "currently:" in older.seen, "the older one runs")
    newer = open_terminal(*LAUNCH)
    wait_until(lambda: "Another program has the name /teleop_twist_keyboard" in older.seen, "it says what it waits for")
    wait_until(lambda: "currently:" in newer.seen, "the newer one runs")
    newer.type("j")
    wait_until(lambda: listener.heard and listener.heard[-1].wz == 0.5, "and drives")
    newer.type("\x03")
    assert newer.process.wait(20) == 0
    wait_until(lambda: older.seen.count("currently:") == 2, "the older one is back")
    older.type("l")
    wait_until(lambda: listener.heard[-1].wz == -0.5, "and drives")
