"""What happens when during a soak: the same seed gives the same run.

Each round of four minutes: drive, stand with nobody watching, drive while viewers come and go; two programs die, one
after the other, and the link is cut.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import NamedTuple

ROUND = 240.0
"""[s]"""
DRIVING = ("window", "terminal", "topic", "topic")
VIEWERS = ("page", "stalled page", "camera", "window")
LONGEST_CUT = 6.0
"""[s]; longer than every time-out of driving, so that everything connects again."""
PHASES = ((0.0, "driving"), (70.0, "idle"), (130.0, "driving"))
DRIVES = ((3.0, 66.0), (135.0, 236.0))
"""When somebody drives, from and to [s]: also while programs die."""


class Event(NamedTuple):
    """`kind` begins at `at` seconds and lasts for `seconds`."""

    at: float
    kind: str
    what: str
    seconds: float


def rounds(seed: int, length: float = ROUND, kills: bool = True) -> Iterator[list[Event]]:
    """Yield the events of each round, with times from its beginning [s], for ever.

    Args:
        length: Of a round [s]; a shorter one has as many events, for tries.
        kills: Whether programs die; otherwise each lives as long as the run, and shows whether it comes to rest.
    """
    dice = random.Random(seed)
    number = 0
    while True:
        events = [Event(at, "phase", phase, 0.0) for at, phase in PHASES]
        for begin, end in DRIVES:
            at = begin
            while at < end:
                seconds = dice.uniform(0.4, 3.0)
                events.append(Event(at, "drive", dice.choice(DRIVING), seconds))
                at += (seconds + dice.uniform(0.5, 2.5)) * ROUND / length
        events.append(Event(60.0, "say", f"round {number}", 0.0))
        for _ in range(2):
            events.append(Event(dice.uniform(131.0, 150.0), "viewer", dice.choice(VIEWERS), dice.uniform(10.0, 25.0)))
        deaths = [Event(at, "kill", f"{dice.random():.6f}", 0.0) for at in (172.0, 192.0)]
        events += deaths if kills else []
        events.append(Event(212.0, "cut", "link", dice.uniform(0.2, LONGEST_CUT)))
        yield sorted(event._replace(at=event.at * length / ROUND) for event in events)
        number += 1
