"""What is kept from moving the robot by itself, while somebody has it and afterwards. Times are arguments."""

from __future__ import annotations

import threading

import pytest
from naoqi_driver.connection import CallRefused
from naoqi_driver.head_driver import HOLD_PERIOD, PILOT_GONE, HeadDriver

from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.teleop.looking import Look, Manner

AHEAD = Velocity(0.2, 0.0, 0.0)


class Robot:
    """Awareness alone; a connection to it."""

    problem = ""

    def __init__(self, mode: str) -> None:
        self.enabled, self.paused, self.mode = True, False, mode

    def call(self, service, method, *arguments, timeout=1.0):
        if service != "ALBasicAwareness":
            raise CallRefused(f"there is no {service}")
        return getattr(self, method)(*arguments)

    def isEnabled(self):
        return self.enabled

    def isAwarenessPaused(self):
        return self.paused

    def pauseAwareness(self):
        self.paused = True

    def resumeAwareness(self):
        self.paused = False

    def getTrackingMode(self):
        return self.mode

    def setTrackingMode(self, mode):
        self.mode = mode


@pytest.mark.parametrize("mode", ["BodyRotation", "MoveContextually"])
@pytest.mark.parametrize("having", [lambda head, now: head.drives(AHEAD, now), lambda head, now: head.piloted(now)])
def test_the_base_does_not_turn_by_itself_while_somebody_has_the_robot(having, mode):
    robot = Robot(mode)
    head = HeadDriver(robot, 0.15)
    head.drives(ZERO_VELOCITY, 10.0)
    head.supervise(10.0)
    assert robot.mode == mode, "nobody drives"
    having(head, 11.0)
    head.supervise(11.1)
    assert robot.mode == "Head" and not robot.paused, "the head may follow people"
    robot.mode = mode  # the robot's life has set it anew
    having(head, 11.2 + HOLD_PERIOD)
    head.supervise(11.2 + HOLD_PERIOD)
    assert robot.mode == "Head"
    head.supervise(11.3 + HOLD_PERIOD + PILOT_GONE)
    assert robot.mode == mode, "as it was before"


def test_looking_around_ends_awareness_at_once():
    robot = Robot("BodyRotation")
    head = HeadDriver(robot, 0.15)
    head.piloted(10.0)
    head.supervise(10.0)
    head.look(Look(Manner.AHEAD), 10.1)
    head.supervise(10.2)
    assert robot.paused and robot.mode == "Head"
    head.close()
    assert not robot.paused and robot.mode == "BodyRotation"


@pytest.mark.parametrize("mode", ["Head", "WholeBody"])
def test_what_does_not_move_the_base_stays_and_so_does_what_is_off(mode):
    robot = Robot(mode)
    head = HeadDriver(robot, 0.15)
    head.drives(AHEAD, 10.0)
    head.supervise(10.0)
    assert robot.mode == mode
    robot.mode, robot.enabled = "BodyRotation", False
    head.drives(AHEAD, 20.0)
    head.supervise(20.0)
    assert robot.mode == "BodyRotation"


def piloted(mode):
    """A robot that moved its base by this mode, and a head whose pilot has ended that."""
    robot = Robot(mode)
    head = HeadDriver(robot, 0.15)
    head.piloted(10.0)
    head.supervise(10.0)
    return robot, head


def test_the_newest_mode_is_given_back():
    robot, head = piloted("BodyRotation")
    robot.mode = "MoveContextually"
    head.piloted(10.1 + HOLD_PERIOD)
    head.supervise(10.1 + HOLD_PERIOD)
    assert robot.mode == "Head"
    head.supervise(10.2 + HOLD_PERIOD + PILOT_GONE)
    assert robot.mode == "MoveContextually"


def test_a_mode_that_the_owner_has_set_meanwhile_stays():
    robot, head = piloted("MoveContextually")
    robot.mode = "WholeBody"
    head.supervise(10.1 + PILOT_GONE)
    assert robot.mode == "WholeBody"


def test_what_a_driver_had_ended_that_died_is_given_back_by_its_successor():
    robot = Robot("MoveContextually")
    died = HeadDriver(robot, 0.15)
    died.look(Look(Manner.AHEAD), 10.0)
    died.supervise(10.0)
    assert robot.paused and robot.mode == "Head"
    head = HeadDriver(robot, 0.15, f"something else; {died.ended}")
    head.supervise(11.0)
    head.piloted(11.1)
    head.supervise(11.2)
    assert robot.paused and robot.mode == "Head", "the pilot was not heard of at once"
    head.supervise(11.3 + PILOT_GONE)
    assert not robot.paused and robot.mode == "MoveContextually" and not head.ended


class HesitantRobot(Robot):
    """It ends its base's movement when it may."""

    def __init__(self, mode: str) -> None:
        super().__init__(mode)
        self.asked, self.may = threading.Event(), threading.Event()

    def setTrackingMode(self, mode):
        if mode == "Head":
            self.asked.set()
            self.may.wait(10.0)
        super().setTrackingMode(mode)


def test_what_is_being_ended_when_the_driver_ends_is_given_back():
    robot = HesitantRobot("MoveContextually")
    head = HeadDriver(robot, 0.15)
    head.piloted(10.0)
    holding = threading.Thread(target=head.supervise, args=(10.0,))
    ending = threading.Thread(target=head.close)
    holding.start()
    assert robot.asked.wait(10.0)
    ending.start()
    ending.join(0.2)  # as long as it takes who does not wait for the other
    robot.may.set()
    holding.join(10.0)
    ending.join(10.0)
    assert robot.mode == "MoveContextually" and not head.ended
    head.piloted(20.0)
    head.supervise(20.0)
    assert robot.mode == "MoveContextually", "the driver has ended"
