"""How the processor time of reading a text grows with the text."""

from __future__ import annotations

import time
from collections.abc import Callable

SHORT, LONG = 2_000, 20_000
"""Letters; the long one is the most that can be said at once."""
MOST_GROWTH = 35.0
"""A text of ten times the length takes ten times as long, one hundred times where each letter has all others read."""
TRIES = 5


def grows_in_proportion(read: Callable[[str], object], part: str) -> bool:
    """Whether a text of ten times as many `part` takes about ten times as long. The least of a few tries counts: other
    threads and the caches of a busy machine only ever add to it."""
    return _cost(read, part, LONG) < MOST_GROWTH * _cost(read, part, SHORT)


def _cost(read: Callable[[str], object], part: str, length: int) -> float:
    """Return the processor time of reading `part` repeated up to `length` letters [s]."""
    text = (part * (length // len(part) + 1))[:length]
    times = []
    for _ in range(TRIES):
        begin = time.thread_time()
        read(text)
        times.append(time.thread_time() - begin)
    return min(times)
