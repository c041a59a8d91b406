"""Keys, buttons and fingers that are pressed again while a busy machine keeps them from counting."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

PATIENCE = 2.0
"""[s] from one press to the next, while it has no effect."""


def press_until(
    press: Callable[[], object],
    release: Callable[[], object],
    wait_until: Callable,
    condition: Callable[[], bool],
    what: str,
) -> None:
    """Press until something is so. A page or keyboard that was not run for half a second, on a busy machine, lets go of
    what is held, as it must: then it is released and pressed again."""
    pressed = -math.inf

    def tried() -> bool:
        nonlocal pressed
        if condition():
            return True
        if time.monotonic() - pressed > PATIENCE:
            if pressed > -math.inf:
                release()
            press()
            pressed = time.monotonic()
        return False

    wait_until(tried, what)
