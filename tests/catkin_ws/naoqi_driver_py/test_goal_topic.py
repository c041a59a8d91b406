"""How old a goal is that waited for its turn; see test_driving.py for those that are driven to."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import PoseStamped
from naoqi_driver.goal_topic import Given, age_of


def test_a_goal_without_a_stamp_ages_while_it_waits():
    given = Given(PoseStamped(), 10.0, object())
    assert age_of(given, 10.0) == 0.0
    assert age_of(given, 11.5) == pytest.approx(1.5)
