"""Three machines that are far apart; see `tests/bench/far_network.py`."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest


def load(name: str) -> ModuleType:
    """A module of the benchmarks, which are a folder and no package."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parents[2] / "bench" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def bench_module() -> Callable[[str], ModuleType]:
    return load


@pytest.fixture(scope="module")
def far_network() -> Iterator:
    """The pilot's machine, the Robotino's and the Pepper's."""
    made = load("far_network").FarNetwork(3)
    yield made
    made.close()
