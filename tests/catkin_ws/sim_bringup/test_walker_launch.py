"""The walker under the simulation guide's topics: `launch/walker.launch`."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.ros
def test_the_walker_walks_freezes_and_starts_again_by_the_guides_topics(graph, until_true):
    graph.run("roslaunch", str(ROOT / "launch" / "walker.launch"), "port:=0", "terrain:=rough", "gait:=trot")
    probe = graph.probe()
    probe.watch("/body_state", "std_msgs/Float32MultiArray", [f"data.{i}" for i in range(6)])
    probe.watch("/robot_camera", "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id"])
    until_true(lambda: probe.seen("/body_state"), "the simulation runs")
    start = probe.latest("/body_state")
    assert start[2] > 0.15, "it stands"
    assert probe.latest("/robot_camera") == [640, 480, "rgb8", "robot_camera"]

    probe.order("/movement_command", 1)
    until_true(lambda: probe.latest("/body_state")[0] > start[0] + 0.2, "it walks forward")
    probe.order("/movement_command", 0)
    until_true(lambda: math.dist(probe.latest("/body_state"), probe.latest("/body_state")) < 0.002, "it freezes")

    answered, fields = probe.call("/restart_simulation", "std_srvs/Trigger", {})
    assert answered and fields["success"] and fields["message"]
    until_true(lambda: math.dist(probe.latest("/body_state")[:2], start[:2]) < 0.001, "it is back at the start")
