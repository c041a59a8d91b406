"""Turning the head of the simulated robot over drive_lease: who may, when it ends, and what moves it otherwise."""

from __future__ import annotations

import contextlib
import math
import time

import numpy as np
import pytest
from talker import REMOTE_WINDOW, Talker

from telepresence import naoqi
from telepresence.teleop.accounts import Users
from telepresence.teleop.looking import Manner

pytestmark = pytest.mark.ros

PASSWORD = "correct horse"
REST = 0.5
"""Seconds after the last look within which the head stands."""
FARTHEST_OFF = 0.25
"""[m] from the place that was pointed at."""
FOCAL, WIDTH, HEIGHT = 525.0, 640, 480
"""A camera's [px]."""
STILL = 0.01
"""[rad]"""


@pytest.fixture(scope="module")
def robot(graph):
    graph.start_robot()
    session = naoqi.Session()
    session.connect(f"tcp://127.0.0.1:{graph.robot_port}")
    with contextlib.closing(session):
        yield session


@pytest.fixture(scope="module")
def station(graph, robot, tmp_path_factory):
    users = Users(tmp_path_factory.mktemp("users") / "users.db")
    for name in ("anna", "ben"):
        users.add(name, PASSWORD, "pilot")
    graph.run(str(graph.workspace / "lib/avatar_gui/drive_lease"), f"_users:={users.path}")
    graph.run_node("naoqi_driver_py", "naoqi_moveto.py")
    return users.path


@pytest.fixture(scope="module")
def anna(graph, station, wait_until):
    window = Talker(graph.environment, REMOTE_WINDOW, station, "anna", PASSWORD)
    wait_until(lambda: window.ask("state")["mine"], "a free robot is taken")
    yield window
    window.close()


@pytest.fixture(scope="module")
def head(graph, robot):
    probe = graph.probe()
    probe.watch("/head/state", "telepresence_msgs/HeadState", ["yaw", "pitch", "down", "problem"])
    motion = robot.service("ALMotion")
    return probe, lambda: motion.getAngles(["HeadYaw", "HeadPitch"], True)


def test_the_pilot_turns_the_head_and_its_limits_follow(anna, head, wait_until):
    probe, angles = head
    anna.ask("look", Manner.GOAL, 1.6, 0.44)
    wait_until(lambda: abs(angles()[0] - 1.6) < 0.03, "the head is there")
    assert angles()[1] == pytest.approx(0.2356, abs=0.03)  # 13.5 degrees: lower it does not go there
    wait_until(lambda: abs(probe.seen("/head/state")[-1][1][0] - 1.6) < 0.03, "and says so")
    # It may be 0.03 rad short of there, where it can nod a quarter of that farther.
    assert probe.seen("/head/state")[-1][1][2:] == [pytest.approx(0.2356, abs=0.01), ""]
    anna.ask("look", Manner.AHEAD, 0.0, 0.0)
    wait_until(lambda: abs(angles()[0]) < 0.03, "centre")
    anna.ask("look")


def test_the_head_stands_soon_after_the_last_look(anna, head, wait_until):
    _, angles = head
    rate = 0.5  # [rad/s]
    anna.ask("look", Manner.RATE, rate, 0.0)
    wait_until(lambda: angles()[0] > 0.1, "the head turns")
    began = angles()[0]
    anna.ask("look")

    def stands() -> bool:
        before = angles()[0]
        time.sleep(0.3)  # in which it may not move
        return angles()[0] == pytest.approx(before, abs=STILL)

    wait_until(stands, "the head stands")
    # As far as it turns in that time; what was on its way on a busy machine may take as long again.
    assert abs(angles()[0] - began) < 2 * REST * rate


def test_nobody_else_turns_it_nor_anybody_while_the_red_stop_is_pressed(graph, station, anna, head, wait_until):
    _, angles = head
    ben = Talker(graph.environment, REMOTE_WINDOW, station, "ben", PASSWORD)
    wait_until(lambda: ben.ask("state")["session"], "ben has joined")
    before = angles()[0]
    ben.ask("look", Manner.GOAL, -1.5, 0.0)
    anna.ask("ask", "stop", "")
    wait_until(lambda: anna.ask("state")["stopped_by"] == "anna", "the stop is latched")
    anna.ask("look", Manner.GOAL, -1.5, 0.0)
    time.sleep(0.6)  # of trying
    assert angles()[0] == pytest.approx(before, abs=STILL)
    ben.ask("look")
    anna.ask("ask", "reset_stop", "")
    wait_until(lambda: angles()[0] < -1.4, "then the pilot turns it")
    anna.ask("look")
    ben.close()


@pytest.fixture(scope="module")
def body(graph, station, robot):
    """What gives the camera its place: the joints, and the transforms between the robot's parts."""
    graph.run_node("naoqi_driver_py", "naoqi_joint_states.py")
    graph.run("roslaunch", "pepper_description", "pepper_publisher.launch")
    return robot.service("ALMotion")


def pixel_of(motion, place):
    """The pixel of the front camera that shows a place on the floor [m from the robot], as the robot itself says."""
    *at, roll, pitch, yaw = motion.getPosition("CameraTop", 2, True)
    cr, sr, cp, sp, cy, sy = (f(angle) for angle in (roll, pitch, yaw) for f in (math.cos, math.sin))
    rotation = np.array(
        (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )
    )
    ahead, left, up = rotation.T @ (np.array((*place, 0.0)) - at)
    return WIDTH / 2 - FOCAL * left / ahead, HEIGHT / 2 - FOCAL * up / ahead


def test_a_hand_on_the_floor_leads_there_while_the_head_is_turned_and_goes_on_turning(anna, body, head, wait_until):
    _, angles = head
    anna.ask("look", Manner.GOAL, 0.7, 0.3)
    wait_until(lambda: abs(angles()[0] - 0.7) < 0.02 and abs(angles()[1] - 0.3) < 0.02, "the head is turned")
    time.sleep(0.3)  # until it stands and the transforms have followed
    aside = 1.0, 0.8
    x, y, theta = body.getRobotPosition(True)
    c, s = math.cos(theta), math.sin(theta)
    there = x + c * aside[0] - s * aside[1], y + s * aside[0] + c * aside[1]
    begun = time.monotonic()

    def found():
        if anna.ask("state")["target"] is None:  # the transforms have just begun
            anna.ask("floor", "CameraTop_optical_frame", FOCAL, WIDTH, HEIGHT, *pixel_of(body, aside))
        return anna.ask("state")["target"]

    wait_until(found, "the window knows the place")
    assert time.monotonic() - begun < 30.0 and anna.ask("state")["target"] == pytest.approx(there, abs=0.1)
    anna.ask("look", Manner.RATE, -0.3, 0.0)
    distance = lambda: math.dist(body.getRobotPosition(True)[:2], there)  # noqa: E731
    wait_until(lambda: distance() < FARTHEST_OFF, "the robot is there")
    anna.ask("look")
    anna.ask("floor")
    time.sleep(0.7)  # of braking
    assert distance() < FARTHEST_OFF


def test_the_head_does_not_move_by_itself_while_a_pilot_looks_around(anna, robot, head, wait_until):
    awareness, motion = robot.service("ALBasicAwareness"), robot.service("ALMotion")
    listening = robot.service("ALListeningMovement")
    awareness.setTrackingMode("BodyRotation")
    awareness.setEnabled(True)
    wait_until(lambda: awareness.getTrackingMode() == "Head", "the base does not turn beside a pilot")
    listening.setEnabled(False)
    motion.setBreathEnabled("Body", True)
    anna.ask("look", Manner.GOAL, 0.8, 0.1)
    wait_until(lambda: awareness.isAwarenessPaused() and not motion.getBreathEnabled("Head"), "it is kept still")
    assert motion.getBreathEnabled("LArm")
    anna.close()
    wait_until(lambda: not awareness.isAwarenessPaused(), "without a pilot it looks at people again")
    wait_until(lambda: awareness.getTrackingMode() == "BodyRotation", "and turns to them")
    assert motion.getBreathEnabled("Head") and not listening.isEnabled()
