"""Pepper's base step by step: answers of ALMotion that come when the test says so."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from naoqi_driver.onboard.pepper_base import BRAKING_TIME, HANGING_TIME, LOST_TIME, RELEASE_TIME, PepperBase

from telepresence.drive.pilots import PilotVelocity
from telepresence.drive.server import Outcome
from telepresence.robot_side.naoqi_values import NaoqiError

PERIOD = 0.05


class Answer:
    """As of `telepresence.robot_side.naoqi_connection`."""

    def __init__(self, name: str) -> None:
        self.name, self.come, self.error = name, False, ""

    def running(self) -> bool:
        return not self.come

    def value(self) -> bool:
        if self.error:
            raise NaoqiError(self.error)
        return True


class Bench:
    """A base whose steps are made one by one."""

    def __init__(self) -> None:
        self.sent: list[Answer] = []
        self.motion: SimpleNamespace | None = SimpleNamespace(send=self._send)
        self.said: list[str] = []
        self.dropped: list[str] = []
        self.base = PepperBase(
            SimpleNamespace(motion=lambda: self.motion, connections=0, near=True, problem="", drop=self.dropped.append),
            SimpleNamespace(note=self._note, stop=lambda: self.said.append("stop"), is_blind=lambda *_: False),
        )
        self.now = 0.0

    def _note(self, moving: bool, _now: float) -> str:
        self.said.append("moving" if moving else "resting")
        return ""

    def _send(self, name: str, *_arguments: object) -> Answer:
        self.sent.append(Answer(name))
        return self.sent[-1]

    def step(
        self,
        velocity: tuple[float, float, float] | None = None,
        goal: tuple[float, float, float] | None = None,
        *,
        cut: bool = False,
    ) -> Outcome:
        self.now += PERIOD
        command = None if velocity is None else PilotVelocity(*velocity, self.now)
        driven_to = None if goal is None else SimpleNamespace(pose=goal)
        return self.base.step(self.now, command, driven_to, SimpleNamespace(cut=cut, end_goal=lambda *_: None))

    def answer(self, *names: str) -> None:
        for call in self.sent:
            call.come = call.come or call.name in names

    def names(self) -> list[str]:
        return [call.name for call in self.sent if call.name != "moveIsActive"]


@pytest.mark.parametrize("late", [("killMove",), ("killMove", "stopMove")])
def test_the_late_answer_to_a_kill_does_not_hide_the_motion_after_it(late):
    bench = Bench()
    bench.step((0.2, 0.0, 0.0))
    bench.answer("move")
    for _ in range(2 + round(BRAKING_TIME / PERIOD)):
        bench.step(cut=True)
    assert bench.names() == ["move", "stopMove", "killMove"], "the pilot fell silent"
    bench.step((0.2, 0.0, 0.0))
    assert bench.names()[-1] == "move", "the pilot is back"
    bench.answer("move", *late)
    bench.step()
    assert bench.names()[-1] == "stopMove", "what the pilot lets go of stops"


def test_who_drives_on_while_almotion_hangs_does_not_keep_the_server_from_waiting():
    bench = Bench()
    bench.step((0.2, 0.0, 0.0))
    bench.step()
    assert bench.names() == ["move", "stopMove"] and bench.base.due() > bench.now, "it is killed later"
    for _ in range(round(2.0 * RELEASE_TIME / PERIOD)):
        bench.step((0.2, 0.0, 0.0))
        assert bench.base.due() > bench.now
    bench.step()
    bench.step()
    assert bench.names() == ["move", "stopMove", "killMove"], "let go again"


def test_a_server_that_loses_naoqi_while_it_drives_has_the_second_process_stop_the_robot():
    bench = Bench()
    bench.step((0.2, 0.0, 0.0))
    bench.motion = None
    for _ in range(2 * round(LOST_TIME / PERIOD)):
        bench.step((0.2, 0.0, 0.0))
    assert bench.said[:5] == ["moving", *["stop", "resting"] * 2], "the second process may just start"
    assert bench.said[-2:] == ["resting"] * 2


def test_a_server_that_loses_naoqi_while_the_robot_rests_says_nothing():
    bench = Bench()
    bench.step()
    bench.motion = None
    bench.step()
    assert bench.said == ["resting"] * 2


def test_a_stop_that_may_have_overtaken_a_velocity_is_sent_again():
    bench = Bench()
    bench.step((0.2, 0.0, 0.0))
    bench.step(cut=True)
    bench.answer("stopMove")
    bench.step(cut=True)
    assert bench.said[-1] == "moving", "the velocity may begin only now"
    bench.answer("move", "stopMove")
    bench.step(cut=True)
    bench.step(cut=True)
    assert bench.said[-1] == "moving" and bench.names()[-1] == "stopMove", "one that was sent after the answer"
    bench.answer("stopMove")
    bench.step(cut=True)
    assert bench.said[-1] == "resting"


def test_a_goal_that_a_stop_may_have_overtaken_is_ended():
    bench = Bench()
    bench.step(goal=(1.0, 0.0, 0.0))
    bench.step(cut=True)
    bench.answer("stopMove")
    bench.step(cut=True)
    bench.step(cut=True)
    assert bench.names() == ["moveTo", "stopMove", "stopMove"]
    bench.answer("moveTo", "stopMove")
    bench.step(cut=True)
    bench.step(cut=True)
    bench.answer("stopMove", "killMove")
    bench.step(cut=True)
    assert bench.said[-1] == "resting"


def test_of_two_goals_the_first_may_also_begin_late():
    bench = Bench()
    for goal in ((1.0, 0.0, 0.0), (2.0, 0.0, 0.0)):
        bench.step(goal=goal)
    first, second = [call for call in bench.sent if call.name == "moveTo"]
    bench.step(cut=True)
    second.come = True
    bench.answer("stopMove")
    bench.step(cut=True)
    bench.step(cut=True)
    bench.answer("stopMove")
    bench.step(cut=True)
    assert bench.said[-1] == "moving", "the first goal has no answer"
    first.come = True
    for _ in range(3):
        bench.step(cut=True)
        bench.answer("stopMove", "killMove")
    assert bench.said[-1] == "resting"


@pytest.mark.parametrize(
    "motion", [{"velocity": (0.2, 0.0, 0.0)}, {"goal": (1.0, 0.0, 0.0)}], ids=["a velocity", "a goal"]
)
def test_an_almotion_that_never_answers_does_not_get_stops_for_ever(motion):
    bench = Bench()
    bench.step(**motion)
    for _ in range(round(HANGING_TIME / PERIOD) - 1):
        bench.step(cut=True)
        bench.answer("stopMove", "killMove")
    assert not bench.dropped
    for _ in range(3):
        bench.step(cut=True)
    assert bench.dropped, "with the link the velocity is over, too"


def test_a_stop_that_overtook_is_forgotten_by_who_drives_on():
    bench = Bench()
    bench.step((0.2, 0.0, 0.0))
    bench.step(cut=True)
    bench.answer("stopMove", "move")
    for _ in range(round(2.0 * HANGING_TIME / PERIOD)):
        bench.step((0.2, 0.0, 0.0))
        bench.answer("move")
    assert not bench.dropped


def test_who_presses_stop_stops_also_a_robot_that_is_believed_to_rest():
    bench = Bench()
    bench.step()
    bench.base.do("stop", "anna")
    bench.step()
    assert bench.names() == ["stopMove"]


def test_a_refusal_is_reported_with_its_reason():
    bench = Bench()
    bench.step((0.2, 0.0, 0.0))
    move = next(call for call in bench.sent if call.name == "move")
    move.error, move.come = "\tALMotion::move\n\tThe power hatch is open", True
    assert "ALMotion::move: The power hatch is open" in bench.step((0.2, 0.0, 0.0)).reason
