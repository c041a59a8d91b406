"""The gamepad program with a pipe in place of the gamepad, on a private graph."""

from __future__ import annotations

import os

import pytest

from telepresence.teleop.joystick import AXIS, BUTTON, EVENT

pytestmark = pytest.mark.ros


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
    send(BUTTON, 5, 0)
    send(BUTTON, 5, 1)
    until_true(lambda: [pytest.approx(0.3), 0.0, 0.0] in velocities(), "full speed ahead")
    send(BUTTON, 5, 0)
    until_true(lambda: velocities()[-1] == [0.0, 0.0, 0.0], "zeros when the button is let go")
