"""What the tests of a NAOqi server connect with; the fixture `qi` of the simulated Pepper's tests has it from here."""

import contextlib
import importlib
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest
from vendors_qi import THERE_IS_ONE

MODULES = {"qi": "qi", "ours": "telepresence.naoqi"}
DEFAULT = "qi" if THERE_IS_ONE else "ours"

with_both_clients = pytest.mark.parametrize(
    "qi", [pytest.param("qi", marks=pytest.mark.vendor), "ours"], indirect=True, scope="session"
)
"""Marks a module or a test that runs twice."""


def client_library(name: str) -> ModuleType:
    """Return the vendor's library for "qi", ours for "ours"; both have the same interface."""
    return importlib.import_module(MODULES[name])


@contextlib.contextmanager
def connected(qi: ModuleType, url: str) -> Iterator[Any]:
    """Give a session with the server at `url`, closed afterwards."""
    client = qi.Session()
    client.connect(url)
    try:
        yield client
    finally:
        client.close()
