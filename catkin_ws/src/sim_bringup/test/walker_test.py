#!/usr/bin/env python3
"""The walker under the simulation guide's topics: it walks, freezes and starts again."""

import math

import rostest
from telepresence_ros.launch_test import LaunchTest


class Walker(LaunchTest):
    nodes = ("/robot_control_node",)

    def test_the_walker_walks_freezes_and_starts_again_by_the_guides_topics(self):
        probe = self.probe
        probe.watch("/body_state", "std_msgs/Float32MultiArray", [f"data.{i}" for i in range(6)])
        probe.watch("/robot_camera", "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id"])
        start = self.latest("/body_state")
        self.assertGreater(start[2], 0.15, "it stands")
        self.assertEqual(self.latest("/robot_camera"), [640, 480, "rgb8", "robot_camera"])

        probe.order("/movement_command", 1)
        self.until(lambda: self.latest("/body_state")[0] > start[0] + 0.2, "it walks forward")
        probe.order("/movement_command", 0)
        self.until(lambda: math.dist(self.latest("/body_state"), self.latest("/body_state")) < 0.002, "it freezes")

        answered, fields = probe.call("/restart_simulation", "std_srvs/Trigger", {})
        self.assertTrue(answered and fields["success"] and fields["message"], fields)
        self.until(lambda: math.dist(self.latest("/body_state")[:2], start[:2]) < 0.001, "it is back at the start")


if __name__ == "__main__":
    rostest.rosrun("sim_bringup", "walker", Walker)
