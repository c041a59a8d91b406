"""Logs of modules without ROS go where rospy's go."""

import logging

import pytest
from telepresence_ros.logs import OURS, route_logs_to_ros


class Kept(logging.Handler):
    def __init__(self):
        super().__init__()
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


@pytest.fixture
def rosout(monkeypatch):
    handler = Kept()
    monkeypatch.setattr(logging.getLogger("rosout"), "handlers", [handler])
    for name in OURS:
        for what in ("handlers", "propagate", "level"):
            monkeypatch.setattr(logging.getLogger(name), what, getattr(logging.getLogger(name), what))
    return handler


@pytest.mark.parametrize("name", OURS)
def test_what_our_modules_tell_is_told_once_on_rosout(rosout, name):
    route_logs_to_ros()
    logging.getLogger(f"{name}.part").info("the robot answers")
    logging.getLogger(f"{name}.part").debug("nobody wants to know")
    assert rosout.lines == ["the robot answers"]
