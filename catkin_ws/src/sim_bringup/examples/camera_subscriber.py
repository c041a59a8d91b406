#!/usr/bin/env python3
"""Receive the simulated robot's pictures as arrays, as the simulation guide's camera subscriber does:

    rosrun sim_bringup camera_subscriber.py
    rosrun sim_bringup camera_subscriber.py _save:=robot.png

It works with `robot_camera` of every simulation; with several robots in one world say which: `__ns:=/rto3`. The guide
converts with cv_bridge, which Debian's ROS lacks; `telepresence.video.images.read_image_message` does the same.

Put your own idea into `look`. Parameters: ~save: a file for the newest picture (PNG or JPEG); "" for none.
"""

import cv2
import rospy
from sensor_msgs.msg import Image
from telepresence_ros.master_watch import wait_for_master

from telepresence.video.images import read_image_message


class CameraSubscriber:
    def __init__(self):
        self._save = rospy.get_param("~save", "")
        # One picture may wait, and the buffer holds more than one, so that what comes is always the newest.
        rospy.Subscriber("robot_camera", Image, self._take, queue_size=1, buff_size=1 << 22)

    def look(self, picture):
        """Your vision: `picture` is (height, width, 3) uint8 in OpenCV's order, blue, green, red."""
        height, width = picture.shape[:2]
        rospy.loginfo_throttle(1.0, f"Received image: {width}x{height}, mean brightness {picture.mean():.0f}")
        if self._save:
            cv2.imwrite(self._save, picture)

    def _take(self, message):
        self.look(cv2.cvtColor(read_image_message(message), cv2.COLOR_RGB2BGR))


def main():
    wait_for_master()  # rospy alone waits for ever, even after Ctrl-C
    rospy.init_node("camera_subscriber", anonymous=True)
    CameraSubscriber()
    rospy.spin()


if __name__ == "__main__":
    main()
