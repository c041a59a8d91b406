"""One simulated robot behind a real socket, shared by the tests; each test finds it at the start and awake.

`qi` is what clients are made of: the vendor's library, or ours with `--naoqi-client=ours` and where there is no other.
A module that is to run with both is marked `naoqi_clients.with_both_clients`.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from naoqi_clients import client_library, connected

from pepper_sim import robot_python
from pepper_sim.simulation import Simulation

FOLDER = Path(__file__).parent
PROGRAMS = FOLDER / "programs"
"""Complete programs as people write them for a real Pepper."""


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


STANDSTILL = contextlib.ExitStack()
ROBOTS: list[Simulation] = []
"""The shared one, once there is one."""


@pytest.hookimpl(tryfirst=True)  # before anything that the test uses
def pytest_runtest_setup() -> None:
    STANDSTILL.close()


@pytest.hookimpl(trylast=True)  # after everything that the test used
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> None:
    """The shared robot's world stands still while tests of other folders run: it would take the processor from them."""
    if nextitem is not None and FOLDER not in nextitem.path.parents:
        for simulation in ROBOTS:
            STANDSTILL.enter_context(simulation.world.locked())


@pytest.fixture(scope="session")
def simulation() -> Iterator[Simulation]:
    STANDSTILL.close()
    with Simulation(scene="empty", port=0) as running:
        ROBOTS.append(running)
        yield running
        STANDSTILL.close()
        ROBOTS.clear()


@pytest.fixture(scope="session")
def qi(request: pytest.FixtureRequest) -> ModuleType:
    return client_library(getattr(request, "param", request.config.getoption("--naoqi-client")))


@pytest.fixture(scope="session")
def session(simulation: Simulation, qi: ModuleType) -> Iterator[Any]:
    with connected(qi, simulation.url) as client:
        yield client


@pytest.fixture
def naoqi(simulation: Simulation, session: Any) -> Naoqi:
    simulation.restart()
    return Naoqi(simulation, session)


@pytest.fixture(scope="module")
def further_robot(qi: ModuleType) -> Iterator[Callable[[], Naoqi]]:
    """Make a robot of one's own, with a client; it lives as long as the tests of one file."""
    with contextlib.ExitStack() as stack:

        def make() -> Naoqi:
            simulation = stack.enter_context(Simulation(scene="empty", port=0))
            return Naoqi(simulation, stack.enter_context(connected(qi, simulation.url)))

        yield make


@pytest.fixture
def connect(simulation: Simulation, qi: ModuleType) -> Iterator[Callable[[], Any]]:
    """Further clients, closed after the test."""
    with contextlib.ExitStack() as stack:
        yield lambda: stack.enter_context(connected(qi, simulation.url))


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


@pytest.fixture
def start_against_robot(simulation: Simulation, qi: ModuleType, run_program: Callable) -> Callable:
    """Start `programs/NAME.py` as a process against the robot; it is ended after the test.

    It gets what it asks for: --ip and --port, or --qi-url.
    """

    def start(name: str, *arguments: str, **popen: Any) -> subprocess.Popen:
        program = PROGRAMS / f"{name}.py"
        address, port = simulation.url.removeprefix("tcp://").split(":")
        robot = ["--ip", address, "--port", port] if '"--ip"' in program.read_text() else ["--qi-url", simulation.url]
        path = os.environ.get("PYTHONPATH", "")
        if qi.__name__ != "qi":  # ours takes the vendor's place
            path = os.pathsep.join(part for part in (str(Path(robot_python.__file__).parent), path) if part)
        environment = {**os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"}
        return run_program(
            sys.executable, str(program), *robot, *map(str, arguments),
            env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, **popen,
        )  # fmt: skip

    return start


@pytest.fixture
def run_against_robot(start_against_robot: Callable) -> Callable[..., str]:
    """Run `programs/NAME.py` to its end and return what it printed; it must end by itself, without an error."""

    def run(name: str, *arguments: str, timeout: float = 60.0) -> str:
        process = start_against_robot(name, *arguments, stderr=subprocess.PIPE)
        printed, errors = process.communicate(timeout=timeout)
        assert process.returncode == 0, f"{name} ended with {process.returncode}:\n{printed}\n{errors}"
        return printed

    return run
