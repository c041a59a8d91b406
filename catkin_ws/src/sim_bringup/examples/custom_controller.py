#!/usr/bin/env python3
"""A controller of your own for any simulated robot: forward until Ctrl-C, or a distance forward and the same back.

Start a simulator in one terminal and this file in another, from the project's folder:

    python3 sim.py --terrain flat
    python3 custom_controller.py
    python3 custom_controller.py _distance:=0.5

After `. ./env.sh` it is also `rosrun sim_bringup custom_controller.py`.

With several robots in one world, say which: `__ns:=/rto3`. It uses nothing but the topics of `robot_control_node`:

    body_state        std_msgs/Float32MultiArray  x y z [m] roll pitch yaw [rad], 10 Hz    read
    robot_camera      sensor_msgs/Image           640x480 rgb8, 10 Hz                      read
    movement_command  std_msgs/Int32              0 stop, 1 forward, 2 backward            written

Put your own idea into `decide`: it gets the newest state and picture ten times a second and returns what to do. The
rest is what every controller needs: it stops when it no longer knows where it is, when it tips, and when it ends.

Parameters: ~distance [m]: there and back; without it forward until Ctrl-C. ~timeout (60) [s]: so long may there and
back take. The exit code is 0 when the robot came back, or after Ctrl-C on the way forward.
"""

import contextlib
import math
import sys
import time

import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import Float32MultiArray, Int32
from telepresence_ros.master_watch import wait_for_master

STOP, FORWARD, BACKWARD = 0, 1, 2
RATE = 10.0
STALE = 0.5
"""A state or picture older than this [s] is no reason to move."""
TIPPED = math.radians(30.0)
REACHED = 0.02
"""The robot counts as back when it is this near to where it began [m]."""


class CustomController:
    def __init__(self, distance=None):
        """`distance`: there and back [m]; None for forward without end."""
        self.distance = distance
        self.start = None
        self.going_back = False
        self.done = False
        self._state: tuple = ()
        self._picture = None
        self._state_time = self._picture_time = -math.inf
        self._command = rospy.Publisher("movement_command", Int32, queue_size=1)
        rospy.Subscriber("body_state", Float32MultiArray, self._take_state, queue_size=1)
        rospy.Subscriber("robot_camera", Image, self._take_picture, queue_size=1, buff_size=1 << 22)

    def decide(self, x, y, yaw, picture):
        """Your controller: what to do now. `picture` is a sensor_msgs/Image; `picture.data` holds its bytes."""
        if self.start is None:
            self.start = (x, y, yaw)
        start_x, start_y, heading = self.start
        # How far it has come along the direction in which it began.
        gone = (x - start_x) * math.cos(heading) + (y - start_y) * math.sin(heading)
        if self.distance is None:
            return FORWARD
        if not self.going_back and gone >= self.distance:
            rospy.loginfo("%.2f m forward; now back", gone)
            self.going_back = True
        if self.going_back and gone <= REACHED:
            rospy.loginfo("back where it began")
            self.done = True
            return STOP
        return BACKWARD if self.going_back else FORWARD

    def step(self):
        """Decide and command, unless that would be blind."""
        now = time.monotonic()
        if now - self._state_time > STALE or now - self._picture_time > STALE:
            rospy.logwarn_throttle(5.0, "waiting for body_state and robot_camera")
            self._command.publish(STOP)
            return
        x, y, z, roll, pitch, yaw = self._state
        rospy.loginfo_throttle(1.0, f"Robot at: ({x:.2f}, {y:.2f}, {z:.2f})")
        if max(abs(roll), abs(pitch)) > TIPPED:
            rospy.logerr_throttle(5.0, "the robot has tipped over: rosservice call /restart_simulation")
            self._command.publish(STOP)
            return
        self._command.publish(self.decide(x, y, yaw, self._picture))

    def stop(self):
        """Stand still. Said three times, because a program that ends at once may take its last word with it."""
        for _ in range(3):
            self._command.publish(STOP)
            time.sleep(0.1)

    def _take_state(self, message):
        self._state, self._state_time = message.data, time.monotonic()

    def _take_picture(self, message):
        self._picture, self._picture_time = message, time.monotonic()


def main():
    wait_for_master()  # rospy alone waits for ever, even after Ctrl-C
    rospy.init_node("custom_controller")
    distance = rospy.get_param("~distance", None)
    controller = CustomController(None if distance is None else float(distance))
    end = math.inf if distance is None else time.monotonic() + float(rospy.get_param("~timeout", 60.0))
    rospy.on_shutdown(controller.stop)
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown() and not controller.done and time.monotonic() < end:
        controller.step()
        with contextlib.suppress(rospy.ROSInterruptException):  # Ctrl-C
            rate.sleep()
    controller.stop()
    if distance is not None and not controller.done:
        rospy.logerr("the robot did not come back in time; is something in its way?")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
