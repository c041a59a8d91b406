"""A program that is started again does not carry out what a latched publisher was told before."""

import subprocess
import sys
import textwrap

import pytest

pytestmark = pytest.mark.ros

DRIVER = textwrap.dedent("""
    import rospy
    from geometry_msgs.msg import PoseStamped
    from telepresence_ros.past_commands import subscribe_commands
    from telepresence_ros.sender_watch import subscribe_velocities

    rospy.init_node("driver")
    subscribe_velocities("cmd_vel", lambda twist: print("velocity", twist.linear.x, flush=True))
    subscribe_commands("goal", PoseStamped, lambda goal: print("goal", goal.pose.position.x, flush=True))
    print("listens", flush=True)
    rospy.spin()
""")

PILOT = textwrap.dedent("""
    import sys
    import rospy
    from geometry_msgs.msg import Twist

    rospy.init_node("pilot", disable_signals=True)
    publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1, latch=True)
    print("is there", flush=True)
    for line in sys.stdin:
        twist = Twist()
        twist.linear.x = float(line)
        publisher.publish(twist)
""")

PATIENT_DRIVER = DRIVER.replace("rospy.spin()", "") + textwrap.dedent("""
    from rospy.impl.registration import Registration
    from telepresence_ros.past_commands import LATCHED_WITHIN

    topic = rospy.topics.get_topic_manager().get_impl(Registration.SUB, "/cmd_vel")
    while not any(link.header for link in topic.connections):
        rospy.rostime.wallsleep(0.05)
    rospy.rostime.wallsleep(LATCHED_WITHIN)
    print("nothing was latched", flush=True)
    rospy.spin()
""")

WALKER = textwrap.dedent("""
    import threading
    import rospy
    from sim_bringup.movement_command import Movements

    class Legs:
        REPEATS = True

        def move(self, movement):
            print(movement.name, flush=True)

    rospy.init_node("walker")
    ended = threading.Event()
    rospy.on_shutdown(ended.set)
    Movements("movement_command", Legs()).run(ended)
""")
WAITING = {"stdout": subprocess.PIPE, "text": True}


def velocity(speed):
    return "rostopic", "pub", "/cmd_vel", "geometry_msgs/Twist", f"{{linear: {{x: {speed}}}}}"


def goal(x):
    return "rostopic", "pub", "/goal", "geometry_msgs/PoseStamped", f"{{pose: {{position: {{x: {x}}}}}}}"


def movement(number):
    return "rostopic", "pub", "/movement_command", "std_msgs/Int32", str(number)


def test_only_commands_that_are_given_from_now_on_count(ros_master, run_program):
    for command in (velocity(0.1), goal(1.0)):
        assert "latching" in run_program(*command, **WAITING).stdout.readline()
    driver = run_program(sys.executable, "-c", DRIVER, stderr=subprocess.PIPE, **WAITING)
    refused = [driver.stderr.readline(), driver.stderr.readline()]
    assert all("from before this program listened is not obeyed" in line for line in refused), refused
    assert driver.stdout.readline() == "listens\n"
    run_program(*velocity(0.2))
    assert driver.stdout.readline() == "velocity 0.2\n"
    run_program(*goal(2.0))
    assert driver.stdout.readline() == "goal 2.0\n"


def test_the_first_command_of_a_latched_publisher_that_was_there_before_counts(ros_master, run_program):
    pilot = run_program(sys.executable, "-c", PILOT, stdin=subprocess.PIPE, **WAITING)
    assert pilot.stdout.readline() == "is there\n"
    driver = run_program(sys.executable, "-c", PATIENT_DRIVER, stderr=subprocess.STDOUT, **WAITING)
    assert driver.stdout.readline() == "listens\n"
    assert driver.stdout.readline() == "nothing was latched\n"
    print(0.3, file=pilot.stdin, flush=True)
    assert driver.stdout.readline() == "velocity 0.3\n"


def test_the_next_run_of_a_program_with_the_same_name_counts(ros_master, run_program):
    driver = run_program(sys.executable, "-c", DRIVER, **WAITING)
    assert driver.stdout.readline() == "listens\n"
    for speed in (0.1, 0.2):
        pilot = run_program(*velocity(speed), "__name:=pilot", **WAITING)
        assert driver.stdout.readline() == f"velocity {speed}\n"
        pilot.kill()
        assert driver.stdout.readline() == "velocity 0.0\n", "the program that drove has ended"


def test_a_restarted_simulation_does_not_walk_on(ros_master, run_program):
    assert "latching" in run_program(*movement(1), **WAITING).stdout.readline()
    walker = run_program(sys.executable, "-c", WALKER, stderr=subprocess.PIPE, **WAITING)
    assert "send it again" in walker.stderr.readline()
    run_program(*movement(2))
    assert walker.stdout.readline() == "BACKWARD\n"
