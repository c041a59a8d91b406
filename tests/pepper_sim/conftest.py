"""One simulated robot behind a real qi socket, shared by the tests; each test finds it at the start and awake."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from pepper_sim.simulation import Simulation

import qi  # isort: skip  -- after pepper_sim, which sets libqi's log level


@dataclass(frozen=True)
class Naoqi:
    """A client's view of the robot, and the robot itself for what only a person could do."""

    simulation: Simulation
    session: qi.Session

    def __getattr__(self, service: str) -> Any:
        return self.session.service(service)

    @property
    def robot(self) -> Any:
        return self.simulation.robot


@pytest.fixture(scope="session")
def simulation() -> Iterator[Simulation]:
    with Simulation(scene="empty", port=0) as running:
        yield running


@pytest.fixture(scope="session")
def session(simulation: Simulation) -> Iterator[qi.Session]:
    client = qi.Session()
    client.connect(simulation.url)
    yield client
    client.close()


@pytest.fixture
def naoqi(simulation: Simulation, session: qi.Session) -> Naoqi:
    simulation.restart()
    return Naoqi(simulation, session)


@pytest.fixture
def connect(simulation: Simulation) -> Iterator[Callable[[], qi.Session]]:
    """Further clients, closed after the test."""
    clients = []

    def make() -> qi.Session:
        client = qi.Session()
        client.connect(simulation.url)
        clients.append(client)
        return client

    yield make
    for client in clients:
        client.close()


@pytest.fixture
def refused() -> Callable[..., str]:
    """Call something that must fail; the text the client reads."""

    def call(method: Callable[..., Any], *arguments: Any) -> str:
        with pytest.raises(RuntimeError) as caught:
            method(*arguments)
        text = str(caught.value)
        assert "Traceback" not in text and "\nAt:" not in text and ".py" not in text, text
        assert len(text) < 400, text
        return text

    return call
