"""What happens when during a soak: the same seed gives the same run.

Rounds of four minutes: drive, stand with nobody watching, drive while viewers come and go, suffer one fault, recover.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import NamedTuple

ROUND = 240.0
"""[s]"""
DRIVING = ("window", "terminal", "topic")
VIEWERS = ("page", "stalled page", "camera", "window")
LONGEST_CUT = 6.0
"""[s]; longer than every time-out of driving, so that everything connects again."""


class Event(NamedTuple):
    """At `at` seconds `kind` begins, for `seconds`."""

    at: float
    kind: str
    what: str
    seconds: float


def rounds(seed: int) -> Iterator[list[Event]]:
    """Yield the events of each round, with times from its beginning, for ever."""
    dice = random.Random(seed)
    number = 0
    while True:
        events = [Event(0.0, "phase", "driving", 70.0), Event(70.0, "phase", "idle", 60.0)]
        events += [Event(130.0, "phase", "driving", 110.0)]
        for begin, end in ((3.0, 66.0), (135.0, 170.0), (205.0, 232.0)):
            at = begin
            while at < end:
                seconds = dice.uniform(0.4, 3.0)
                events.append(Event(at, "drive", DRIVING[dice.randrange(len(DRIVING))], seconds))
                at += seconds + dice.uniform(0.5, 2.5)
        events.append(Event(68.0, "say", f"round {number}", 0.0))
        for _ in range(2):
            events.append(Event(dice.uniform(131.0, 150.0), "viewer", dice.choice(VIEWERS), dice.uniform(10.0, 25.0)))
        if number % 3 == 2:
            events.append(Event(175.0, "cut", "link", dice.uniform(0.2, LONGEST_CUT)))
        else:
            events.append(Event(175.0, "kill", f"{dice.random():.6f}", 0.0))
        yield sorted(events)
        number += 1
