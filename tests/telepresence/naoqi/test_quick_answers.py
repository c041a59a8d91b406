"""Methods with a quick answer: given on the thread that serves everybody, unless it would have to wait."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from telepresence.naoqi.incoming_call import QUICK_BYTES, NotNow
from telepresence.naoqi.reactor import reactor
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.server import Server
from telepresence.naoqi.session import Session


class Robot:
    """Says on which thread it was asked: "reactor" or "worker"."""

    ready = True

    def quick(self, text: str) -> str:
        if not self.ready:
            raise NotNow
        return self.where(text)

    def where(self, text: str) -> str:
        if text == "wrong":
            raise ValueError("there is no such text")
        return "reactor" if reactor().inside() else "worker"


def offer(robot: Robot, **options: Any) -> tuple[Server, Session]:
    served = ServedObject(**options)
    served.add_method("where", "s", "(s)", robot.where, quick=robot.quick)
    server = Server("tcp://127.0.0.1:0")
    server.register("Robot", served)
    server.start()
    session = Session()
    session.connect(server.endpoints[0])
    return server, session


@pytest.fixture
def robot() -> Robot:
    return Robot()


@pytest.fixture
def service(robot: Robot) -> Iterator[Any]:
    server, session = offer(robot)
    yield session.service("Robot")
    session.close()
    server.close()


def test_is_answered_at_once_while_it_can_be(robot, service):
    assert service.where("") == "reactor"
    robot.ready = False
    assert service.where("") == "worker"
    robot.ready = True
    assert service.where("") == "reactor"


def test_long_arguments_go_to_a_worker(service):
    assert service.where("x" * QUICK_BYTES) == "worker"


def test_errors_reach_the_caller(robot, service):
    for ready in (True, False):
        robot.ready = ready
        with pytest.raises(RuntimeError, match="there is no such text"):
            service.where("wrong")


def test_calls_of_an_object_that_is_not_parallel_keep_their_order(robot):
    server, session = offer(robot, parallel=False)
    assert session.service("Robot").where("") == "worker"
    session.close()
    server.close()


def test_many_quick_calls_at_once_are_all_answered(service):
    answers: list[str] = []

    def ask() -> None:
        answers.extend(service.where("") for _ in range(50))

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20.0)
    assert answers == ["reactor"] * 400
