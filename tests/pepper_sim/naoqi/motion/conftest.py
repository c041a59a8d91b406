"""A client beside that of the test."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest


@pytest.fixture
def insist(connect: Callable[[], Any]) -> Iterator[Callable[..., None]]:
    """Let a further client call one method of ALMotion again and again, until the test ends."""
    over, threads = threading.Event(), []

    def start(method: str, *arguments: Any) -> None:
        motion = connect().service("ALMotion")

        def call() -> None:
            while not over.wait(0.02):
                getattr(motion, method)(*arguments)

        threads.append(threading.Thread(target=call))
        threads[-1].start()

    yield start
    over.set()
    for thread in threads:
        thread.join(10.0)
