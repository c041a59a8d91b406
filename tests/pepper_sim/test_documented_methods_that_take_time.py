"""Documented methods that take time, called side by side on robots of their own: they mostly wait."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest
from documented_calls import LONG, OWN, Caller, put_files

LONG_ONES = {name: entry for name, entry in OWN.items() if entry[1].seconds >= LONG}
ROBOTS = 4


@pytest.fixture(scope="module")
def calls(request: pytest.FixtureRequest, further_robot: Callable) -> Iterator[dict[str, Future]]:
    """The checks of all methods that this session has chosen, running; the longest have begun first."""
    chosen = [item.callspec.params["name"] for item in request.session.items if item.path == Path(__file__)]
    chosen.sort(key=lambda name: -LONG_ONES[name][1].seconds)
    robots: queue.Queue = queue.Queue()
    for _ in range(min(ROBOTS, len(chosen))):
        robot = further_robot()
        put_files(robot.simulation.server.catalogue.disk)
        robots.put(robot)

    def check(name: str) -> None:
        service, method = LONG_ONES[name]
        robot = robots.get()
        try:
            robot.simulation.restart()
            Caller(robot, service).check(method)
        finally:
            robots.put(robot)

    with ThreadPoolExecutor(ROBOTS) as pool:
        yield {name: pool.submit(check, name) for name in chosen}


@pytest.mark.parametrize("name", LONG_ONES)
def test_a_method_that_takes_time(calls, name):
    calls[name].result()
