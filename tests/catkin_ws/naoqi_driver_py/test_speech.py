"""Sentences for a robot that comes and goes: said at once or not at all, and whoever publishes one can see which."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from talker import Caller

from telepresence import naoqi
from telepresence.naoqi.python_object import served
from telepresence.naoqi.server import Server

pytestmark = pytest.mark.ros

PROGRAMS = Path(__file__).parent / "programs"
ENDLESS = "Once upon a time"


class TextToSpeech:
    def __init__(self) -> None:
        self.said: list[str] = []

    def say(self, sentence: str) -> naoqi.Future:
        self.said.append(sentence)
        saying = naoqi.Promise()
        if sentence != ENDLESS:
            saying.setValue(None)
        return saying.future()


@pytest.fixture
def page(graph) -> Iterator[Caller]:
    page = Caller(graph.environment, PROGRAMS / "speaking_page.py")
    yield page
    page.close()


@contextlib.contextmanager
def robot(graph) -> Iterator[list[str]]:
    """A robot that can speak and do nothing else; yields what it says."""
    speech = TextToSpeech()
    server = Server(f"tcp://127.0.0.1:{graph.robot_port}")
    server.register("ALTextToSpeech", served(speech))
    server.start()
    try:
        yield speech.said
    finally:
        server.close()


def test_nobody_listens_to_sentences_while_the_robot_is_away(graph, page, wait_until) -> None:
    node = graph.run_node("naoqi_driver_py", "naoqi_speech.py")
    early = graph.run("rostopic", "pub", "/speech", "std_msgs/String", "Nobody was there.")
    early.wait_for("publishing and latching")
    with robot(graph) as said:
        wait_until(page.can_say, "the robot can speak")
        assert page.say("Good morning.") == ""
        wait_until(lambda: said == ["Good morning."], "it is said")
        assert page.say(ENDLESS) == ""
        wait_until(lambda: said == ["Good morning.", ENDLESS], "it is being said")
    wait_until(lambda: not page.can_say(), "the page sees that the robot is away")
    assert page.say("Lost.") == "No program of this robot takes a sentence now."
    node.wait_for(r"not said, or not to its end: ALTextToSpeech\.say")
    with robot(graph) as said:
        wait_until(page.can_say, "it can speak again")
        assert page.say("Good evening.") == ""
        wait_until(lambda: said, "it is said")
        assert said == ["Good evening."]
