"""How tests wait for what comes when it comes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

Value = TypeVar("Value")

TIMEOUT = 40.0
"""[s] after which a condition counts as never coming; generous, because the machines are shared."""
SHORTEST_PAUSE, LONGEST_PAUSE = 0.002, 0.05
"""[s] from one look to the next: each is half as long again as the one before."""


def wait_until(condition: Callable[[], Value], what: str = "", timeout: float = TIMEOUT) -> Value:
    """Look until `condition()` is true, and return its value.

    Args:
        what: Is the case then, for the message.
        timeout: [s]
    Raises:
        AssertionError: It has not come true in time.
    """
    deadline, pause = time.monotonic() + timeout, SHORTEST_PAUSE
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"{what}: not within {timeout:g} s" if what else f"not within {timeout:g} s")
        time.sleep(pause)
        pause = min(1.5 * pause, LONGEST_PAUSE)
    return value


def comes_true(condition: Callable[[], object], timeout: float = TIMEOUT) -> bool:
    """Whether `condition()` is true within `timeout` [s]."""
    try:
        wait_until(condition, timeout=timeout)
    except AssertionError:
        return False
    return True
