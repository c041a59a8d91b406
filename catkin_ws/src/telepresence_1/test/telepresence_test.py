#!/usr/bin/env python3
"""telepresence_ros.launch with a robot that is a tablet and nothing else: the pilot comes to its chest, the picture of
the robot's camera to a page, as there is no display, and the keyboard is there."""

import json
import os
import re
import signal
import urllib.request

import cv2
import numpy as np
import rospy
import rostest
from telepresence_ros.launch_test import LaunchTest

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.publish import served_object
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.services.al_tablet_service import ALTabletService
from pepper_sim.tablet.tablet import Tablet
from telepresence.naoqi.server import Server

ORANGE = (230, 130, 20)


class Telepresence(LaunchTest):
    nodes = ("/com_cam", "/rob_cam", "/teleop_twist_keyboard")

    def setUp(self):
        super().setUp()
        self.probe.watch("/rosout", "rosgraph_msgs/Log", ["name", "msg"])
        self.probe.watch("/com_cam/status", "diagnostic_msgs/DiagnosticStatus", ["level", "message"])
        source = rospy.get_param("~source")
        cv2.imwrite(source, np.full((480, 640, 3), ORANGE[::-1], np.uint8))
        self.addCleanup(os.unlink, source)
        self.tablet = self.enterContext(Tablet())
        robot = Server(f"tcp://{rospy.get_param('~address')}:9559")
        self.addCleanup(robot.close)
        disk, alarm = RobotDisk(), Alarm()
        self.addCleanup(disk.close)
        self.addCleanup(alarm.close)
        robot.register("ALTabletService", served_object(ALTabletService(self.tablet, disk, alarm)))
        robot.start()

    def test_the_pilot_comes_to_the_tablet_and_the_robots_picture_to_a_page(self):
        self.until(self.tablet_is_orange, "the pilot's picture is on the tablet")
        status = json.loads(self.fetch(f"http://{rospy.get_param('~address')}:10002/status"))
        self.assertEqual((status["name"], status["state"], status["viewers"]), ("Anna", "live", 1))
        self.until(lambda: self.latest("/com_cam/status")[1].startswith("Live; on the tablet"), "the status says so")
        self.assertIn(self.latest("/com_cam/status")[0], (0, [0]))

        page = self.until(self.page_of_rob_cam, "rob_cam says where its page is")
        picture = self.fetch(f"{page}frame.jpg")
        self.assertIsNotNone(cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR))

        os.kill(self.probe.pid("/com_cam"), signal.SIGINT)
        self.until(lambda: not self.tablet_is_orange(), "the page is taken away")

    def fetch(self, url):
        return urllib.request.urlopen(f"{url}?k=of+the+test", timeout=30).read()

    def tablet_is_orange(self):
        picture = self.tablet.image.peek()
        return picture is not None and np.abs(picture.content[200, 320].astype(int) - ORANGE).max() < 15

    def page_of_rob_cam(self):
        """Its last line, which every node repeats for who comes later."""
        lines = "\n".join(text for _, (name, text) in self.probe.seen("/rosout") if name == "/rob_cam")
        found = re.search(r"look at (http://[\d.]+:\d+/) instead", lines)
        return found and found[1]


if __name__ == "__main__":
    rostest.rosrun("telepresence_1", "telepresence", Telepresence)
