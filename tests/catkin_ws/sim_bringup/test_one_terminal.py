"""The simulation guide's programs as a person types them in the project's folder, with any python3 and no ROS master:
`python3 sim.py --terrain flat` and `python3 custom_controller.py`."""

from __future__ import annotations

import math
import os
import signal
from pathlib import Path

import pytest

from telepresence.station.ros_master import master_answers

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[3]

INTERRUPTED = """
import os, signal, sys, threading, xmlrpc.client

request = xmlrpc.client.ServerProxy._ServerProxy__request

def interrupted(proxy, method, words):
    if method == "getParam" and threading.current_thread() is threading.main_thread():
        assert proxy._lock.locked(), "rospy's connection to the master, which signing off needs, too"
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(1000):
            pass  # the handler runs here
    return request(proxy, method, words)

xmlrpc.client.ServerProxy._ServerProxy__request = interrupted
sys.argv = ["sim.py", "--port", "0"]
from sim_bringup.one_terminal import main
sys.exit(main())
"""
"""sim.py that is asked to end while it asks the ROS master for a parameter."""


@pytest.fixture
def plain_python(graph) -> list[str]:
    """Runs a program as in a fresh terminal: none of the project's environment, no ROS master, no display."""
    graph.master.end()
    words = {"HOME": os.environ["HOME"], "PATH": "/usr/bin:/bin", "ROS_MASTER_URI": graph.uri, "ROS_IP": "127.0.0.1"}
    words["ROS_HOME"] = graph.environment["ROS_HOME"]
    graph.environment["PYTHONUNBUFFERED"] = words["PYTHONUNBUFFERED"] = "1"  # as in a terminal
    return ["env", "-i", "-C", str(ROOT), *(f"{name}={value}" for name, value in words.items()), "/usr/bin/python3"]


def test_a_controller_without_a_simulation_says_so_and_ends_with_ctrl_c(graph, plain_python):
    controller = graph.run(*plain_python, "custom_controller.py")
    controller.wait_for(f"No ROS master answers at {graph.uri}")
    controller.signal(signal.SIGINT)
    assert controller.process.wait(20.0) != 0


@pytest.mark.parametrize(
    ("uri", "says"),
    [
        ("http://192.0.2.1:11311", "is another machine, and no ROS master answers there"),
        ("localhost:11311", "ROS_MASTER_URI is 'localhost:11311', and not of the form http://HOST:PORT"),
        ("http://localhost:99999", "and not of the form http://HOST:PORT"),
        ("http://localhost", "and not of the form http://HOST:PORT"),
    ],
)
def test_an_address_where_no_master_can_be_is_named(graph, plain_python, uri, says):
    *words, python = plain_python
    simulation = graph.run(*words, f"ROS_MASTER_URI={uri}", python, "sim.py", "--port", "0")
    assert simulation.process.wait(30.0) == 1
    assert says in simulation.output and "Traceback" not in simulation.output


def test_the_simulation_guides_lines_type_and_print_what_the_guide_quotes(graph, plain_python, wait_until):
    simulation = graph.run(*plain_python, "sim.py", "--terrain", "flat", "--port", "0")
    world = simulation.wait_for(r"Loading world: (\S+) \(flat terrain\)")[1]
    assert (ROOT / world).is_file(), "it names the file that is loaded"
    simulation.wait_for(r"\[robot_control_node\]: Robot Control Node initialized")
    assert "No display here" in simulation.output

    another = graph.run(*plain_python, "sim.py", "--port", "0")
    assert another.process.wait(30.0) == 1 and "a simulation runs already" in another.output

    probe = graph.probe()
    probe.watch("/body_state", "std_msgs/Float32MultiArray", [f"data.{i}" for i in range(6)])
    start = probe.latest("/body_state")
    controller = graph.run(*plain_python, "custom_controller.py")
    controller.wait_for(r"Robot at: \(-?\d+\.\d\d, -?\d+\.\d\d, -?\d+\.\d\d\)")
    wait_until(lambda: probe.latest("/body_state")[0] > start[0] + 0.1, "the controller walks forward")
    controller.signal(signal.SIGINT)
    assert controller.process.wait(20.0) == 0, controller.output
    wait_until(
        lambda: math.dist(probe.latest("/body_state"), probe.latest("/body_state")) < 0.002, "it stops at Ctrl-C"
    )

    simulation.signal(signal.SIGINT)
    assert simulation.process.wait(20.0) == 0, simulation.output
    assert not master_answers(graph.uri), "the ROS master that it brought ends with it"
    assert "Traceback" not in simulation.output + controller.output


def test_a_signal_during_a_question_to_the_master_ends_it(graph):
    simulation = graph.run("python", "-c", INTERRUPTED)
    assert simulation.process.wait(60.0) == 0, simulation.output
    assert "Traceback" not in simulation.output
