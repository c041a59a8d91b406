"""Who looks through a robot is told to its surroundings when it has changed, and once at the beginning."""

from __future__ import annotations

from page_server import OneRobot

from telepresence.page.robot_on_page import RobotOnPage


class Robot(OneRobot):
    def __init__(self) -> None:
        super().__init__()
        self.said: list[list[str]] = []

    def show_who_looks(self, names: list[str]) -> None:
        self.said.append(names)


def test_a_page_that_starts_again_takes_back_what_the_one_before_has_said():
    robot = Robot()
    page = RobotOnPage(robot)
    page.note_who_looks([])
    assert robot.said == [[]], "the tablet still shows what was said last"
    page.note_who_looks([])
    assert robot.said == [[]], "nothing has changed"
