"""The simulated Robotino as a node: what only a simulator knows."""

from __future__ import annotations

import json
import urllib.request

import pytest

pytestmark = pytest.mark.ros


@pytest.fixture(scope="module")
def port(graph):
    port = graph.free_port()
    node = graph.run(
        str(graph.workspace / "lib/rto_bringup/robotino_sim"), "__ns:=/rto3", f"_port:={port}", "_scene:=empty"
    )
    node.wait_for("listens on")
    return port


@pytest.fixture(scope="module")
def probe(graph, port):
    return graph.probe()


def ask(port, path, body=None):
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", body, method="PUT" if body else "GET")
    with urllib.request.urlopen(request, timeout=10.0) as answer:
        return answer.read()


def test_truth_follows_the_robot_and_restart_puts_it_back(port, probe, wait_until):
    probe.watch("/rto3/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "header.frame_id", "child_frame_id"])
    start = probe.latest("/rto3/truth")
    assert start[1:] == ["world", "base_link"]

    def moved():
        ask(port, "/data/omnidrive", b"[0.3,0,0]")
        return probe.newest("/rto3/truth")[0] > start[0] + 0.1

    wait_until(moved, "the truth moves")
    assert probe.call("/rto3/restart_simulation", "std_srvs/Trigger", {})[0] is True
    wait_until(lambda: abs(probe.latest("/rto3/truth")[0] - start[0]) < 0.01, "the robot is back")
    assert json.loads(ask(port, "/data/odometry"))[0] < 0.05


def test_overview_is_drawn_for_subscribers(port, probe):
    probe.watch("/rto3/overview/image_raw", "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id"])
    assert probe.latest("/rto3/overview/image_raw") == [640, 480, "rgb8", "overview"]
