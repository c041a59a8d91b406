"""A robot in a hall with somebody who stands behind it and somebody who sits there; tests place them.

It takes the place of the robot that the other tests share, before which there is nobody.
"""

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import pytest
from naoqi_clients import connected

from pepper_sim.simulation import Simulation


@pytest.fixture(scope="module")
def simulation() -> Iterator[Simulation]:
    with Simulation("empty", port=0, people=["standing@-2,-1.5", "seated@-2,1.5"]) as running:
        yield running


@pytest.fixture(scope="module")
def session(simulation: Simulation, qi: ModuleType) -> Iterator[Any]:
    with connected(qi, simulation.url) as client:
        yield client


@pytest.fixture
def stranger(naoqi: Any, wait_until: Callable) -> Any:
    """Who stands. The robot has forgotten whom it saw before its world was put back."""
    keys = ["PeoplePerception/PeopleDetected", "PeoplePerception/PeopleList"]
    wait_until(lambda: not any(naoqi.ALMemory.getListData(keys)), "nobody is known")
    return naoqi.simulation.world.people["person_1"]
