"""The simulated Pepper as a ROS node."""

from __future__ import annotations

import pytest
import qi

pytestmark = pytest.mark.ros


@pytest.fixture(scope="module")
def node(graph):
    program = graph.run(
        str(graph.workspace / "lib/pepper_bringup/pepper_sim"), f"_port:={graph.robot_port}", "_scene:=apartment"
    )
    program.wait_for(f"simulated pepper listens on tcp://127.0.0.1:{graph.robot_port}")
    return program


@pytest.fixture(scope="module")
def probe(graph, node):
    return graph.probe()


@pytest.fixture(scope="module")
def motion(graph, node):
    session = qi.Session()
    session.connect(f"tcp://127.0.0.1:{graph.robot_port}")
    yield session.service("ALMotion")
    session.close()


def test_truth_tells_where_the_robot_is_and_restart_brings_it_back(probe, motion, wait_until):
    probe.watch("/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y", "header.frame_id"])
    x, y, frame = probe.latest("/truth")
    assert frame == "world"
    motion.moveTo(0.0, 0.0, 0.4)
    motion.moveTo(0.2, 0.0, 0.0)
    moved = probe.latest("/truth")
    assert 0.15 < ((moved[0] - x) ** 2 + (moved[1] - y) ** 2) ** 0.5 < 0.25
    ok, answer = probe.call("/restart_simulation", "std_srvs/Trigger", {})
    assert ok
    assert answer["success"]
    wait_until(lambda: probe.latest("/truth")[:2] == [pytest.approx(x, abs=0.01), pytest.approx(y, abs=0.01)], "back")
    assert motion.robotIsWakeUp() in (True, False), "the client is still connected"


def test_overview_is_drawn_for_who_looks(probe):
    fields = ["width", "height", "encoding", "header.frame_id"]
    probe.watch("/overview/image_raw", "sensor_msgs/Image", fields)
    assert probe.latest("/overview/image_raw") == [640, 480, "rgb8", "overview"]


def test_tablet_is_shown_to_a_reader_that_comes_late(probe):
    probe.watch("/tablet/image_raw", "sensor_msgs/Image", ["width", "height", "encoding"])
    assert probe.newest("/tablet/image_raw") == [640, 400, "rgb8"]


def test_taken_port_ends_the_node_with_an_error(graph, node):
    second = graph.run(
        str(graph.workspace / "lib/pepper_bringup/pepper_sim"),
        f"_port:={graph.robot_port}",
        "_scene:=empty",
        "__name:=second",
    )
    assert second.process.wait(40) == 1
    assert str(graph.robot_port) in second.output


def test_interrupt_ends_it(node):
    assert node.end() == 0
    assert "Traceback" not in node.output
