"""One simulated robot behind a real socket, shared by the tests; each test finds it at the start and awake.

`qi` is what clients are made of: the vendor's library, or ours with `--naoqi-client=ours` and where there is no other.
A module that is to run with both is marked `naoqi_clients.with_both_clients`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import pytest
from naoqi_clients import client_library

from pepper_sim.simulation import Simulation


@dataclass(frozen=True)
class Naoqi:
    """A client's view of the robot, and the robot itself for what only a person could do."""

    simulation: Simulation
    session: Any

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
def qi(request: pytest.FixtureRequest) -> ModuleType:
    return client_library(getattr(request, "param", request.config.getoption("--naoqi-client")))


@pytest.fixture(scope="session")
def session(simulation: Simulation, qi: ModuleType) -> Iterator[Any]:
    client = qi.Session()
    client.connect(simulation.url)
    yield client
    client.close()


@pytest.fixture
def naoqi(simulation: Simulation, session: Any) -> Naoqi:
    simulation.restart()
    return Naoqi(simulation, session)


@pytest.fixture
def connect(simulation: Simulation, qi: ModuleType) -> Iterator[Callable[[], Any]]:
    """Further clients, closed after the test."""
    clients = []

    def make() -> Any:
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
