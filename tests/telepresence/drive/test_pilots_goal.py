"""A pilot's goal: one at a time, ended by silence, and known to the robot by its number."""

import pytest

from telepresence.drive.datagram import DRIVING, ENDED, REACHED, GoalState
from telepresence.drive.pilots_goal import ASKED, GOAL_TIMEOUT, PilotsGoal

POSE = (1.0, 0.0, 0.5)
LATE = GOAL_TIMEOUT + 0.1


@pytest.fixture
def goal():
    return PilotsGoal()


def test_before_the_first_nothing_is_wanted(goal):
    assert goal.state(0.0) == ENDED and goal.wanted(0.0) is None


def test_one_that_is_not_begun_is_as_old_as_its_giving_and_ends_by_silence(goal):
    number = goal.give(POSE, 10.0)
    assert goal.state(10.3) == ASKED and goal.wanted(10.3) == ((number, POSE), 10.0)
    assert goal.state(10.0 + LATE) == ENDED and goal.wanted(10.3) is None


def test_one_that_is_driven_to_is_wanted_now_until_it_is_reached(goal):
    number = goal.give(POSE, 10.0)
    goal.reported(GoalState(number, DRIVING), 10.4)
    assert goal.wanted(10.8) == ((number, POSE), 10.8)
    goal.reported(GoalState(number, REACHED), 10.9)
    assert goal.state(99.0) == REACHED and goal.wanted(10.9) is None


def test_what_is_said_of_another_goal_or_after_the_end_changes_nothing(goal):
    number = goal.give(POSE, 10.0)
    goal.reported(GoalState(number - 1, REACHED), 10.1)
    assert goal.state(10.1) == ASKED
    goal.end()
    goal.reported(GoalState(number, DRIVING), 10.2)
    assert goal.state(10.2) == ENDED


def test_a_robot_that_forgot_its_pilot_does_not_begin_a_goal_anew(goal):
    number = goal.give(POSE, 10.0)
    goal.end_begun()
    assert goal.state(10.1) == ASKED, "it was not begun"
    goal.reported(GoalState(number, DRIVING), 10.2)
    goal.end_begun()
    assert goal.wanted(10.3) is None
