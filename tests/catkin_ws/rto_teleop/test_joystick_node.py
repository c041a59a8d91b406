"""The gamepad program with a pipe in place of the gamepad, on a private graph."""

from __future__ import annotations

import os
import time

import pytest

from telepresence.teleop.joystick import AXIS, BUTTON, EVENT

pytestmark = pytest.mark.ros

LB, RB = 4, 5


@pytest.fixture(scope="module")
def pad(tmp_path_factory):
    path = tmp_path_factory.mktemp("pad") / "js0"
    os.mkfifo(path)
    writer = os.open(path, os.O_RDWR)
    yield str(path), writer
    os.close(writer)


@pytest.fixture(scope="module")
def probe(graph, pad):
    program = str(graph.workspace / "lib/rto_teleop/rto_teleop_joystick")
    graph.run(program, "__ns:=/rto3", f"_device:={pad[0]}").wait_for("gamepad at")
    probe = graph.probe()
    probe.watch("/rto3/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])
    return probe


def test_stick_drives_while_the_button_is_held(pad, probe, until_true):
    def send(kind, number, value):
        os.write(pad[1], EVENT.pack(0, value, kind, number))

    def velocities():
        return [fields for _, fields in probe.seen("/rto3/cmd_vel")]

    send(AXIS, 1, -32767)
    send(BUTTON, RB, 0)
    send(BUTTON, RB, 1)
    time.sleep(0.5)
    assert velocities() == [], "RB is not the dead man's switch"
    send(BUTTON, RB, 0)
    send(BUTTON, LB, 0)
    send(BUTTON, LB, 1)
    until_true(lambda: [pytest.approx(0.3), 0.0, 0.0] in velocities(), "full speed ahead")
    send(BUTTON, RB, 1)
    until_true(lambda: [pytest.approx(0.6), 0.0, 0.0] in velocities(), "RB is fast")
    send(BUTTON, LB, 0)
    until_true(lambda: velocities()[-1] == [0.0, 0.0, 0.0], "zeros when the button is let go")
