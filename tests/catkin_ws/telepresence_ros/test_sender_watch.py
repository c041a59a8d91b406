"""A driver that is sent velocities gets a zero as soon as the program that sent them has ended."""

import subprocess
import sys
import textwrap

import pytest

from telepresence.station import processes

pytestmark = pytest.mark.ros

DRIVER = textwrap.dedent("""
    import rospy
    from telepresence_ros.sender_watch import subscribe_velocities

    def drive(twist):
        header = getattr(twist, "_connection_header", {"callerid": "nobody"})
        print(header["callerid"], twist.linear.x, flush=True)

    rospy.init_node("driver")
    subscribe_velocities("cmd_vel", drive)
    rospy.spin()
""")

PILOT = textwrap.dedent("""
    import sys, rospy
    from geometry_msgs.msg import Twist
    rospy.init_node(sys.argv[1])
    publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    message = Twist()
    message.linear.x = float(sys.argv[2])
    while True:
        publisher.publish(message)
        rospy.rostime.wallsleep(0.05)
""")


def test_the_end_of_who_drives_is_a_zero_and_the_end_of_who_stands_is_nothing(ros_master, run_program):
    driver = run_program(sys.executable, "-c", DRIVER, stdout=subprocess.PIPE, text=True)

    def next_but(*lines):
        return next(line for line in iter(driver.stdout.readline, "") if line.strip() not in lines).strip()

    standing = run_program(sys.executable, "-c", PILOT, "standing", "0")
    assert next_but() == "/standing 0.0"
    processes.send(standing.pid, 9)
    driving = run_program(sys.executable, "-c", PILOT, "driving", "0.2")
    assert next_but("/standing 0.0") == "/driving 0.2"
    processes.send(driving.pid, 9)
    assert next_but("/driving 0.2") == "nobody 0.0"
