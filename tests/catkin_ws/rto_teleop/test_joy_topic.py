"""A gamepad of another node: `joystick.launch device:=none` takes joy_node's topic, which is /joy."""

from __future__ import annotations

import sys
import textwrap

import pytest
import yaml

JOY_NODE = textwrap.dedent("""
    import rospy
    from sensor_msgs.msg import Joy

    rospy.init_node("joy_node")
    publisher = rospy.Publisher("/joy", Joy, queue_size=1)
    drive, ahead = [0] * 4 + [1] + [0] * 6, [0.0, 1.0] + [0.0] * 6
    rate, count = rospy.Rate(20), 0
    while not rospy.is_shutdown():
        rest = count // 10 % 2  # half a second each: a stick that rests counts as stuck
        publisher.publish(axes=[0.0] * 8 if rest else ahead, buttons=[0] * 11 if rest else drive)
        count += 1
        rate.sleep()
""")


def test_no_device_can_be_said_on_the_command_line(roslaunch_says):
    parameters = yaml.safe_load(roslaunch_says("--dump-params", "rto_teleop", "joystick.launch", "device:=none"))
    assert parameters["/rto3/rto_teleop_joystick/device"] == "none"
    arguments = roslaunch_says(
        "--args", "/rto3/rto_teleop_joystick", "rto_teleop", "joystick.launch", "device:=none"
    ).split()
    assert "joy:=/joy" in arguments


@pytest.mark.ros
def test_it_drives_by_the_topic_of_joy_node(graph, wait_until):
    probe = graph.probe()
    probe.watch("/rto3/cmd_vel", "geometry_msgs/Twist", ["linear.x"])
    with (
        graph.run(sys.executable, "-c", JOY_NODE),
        graph.run("roslaunch", "rto_teleop", "joystick.launch", "device:=none") as launch,
    ):
        wait_until(lambda: any(vx > 0.0 for _, (vx,) in probe.seen("/rto3/cmd_vel")), "the stick drives")
        assert launch.end() == 0
