"""How often somebody may try to come in. No clock: the time is an argument."""

from __future__ import annotations

import ipaddress
import math
from collections import OrderedDict

MOST = 10
"""Failed tries of one address, one link or one person ..."""
PERIOD = 60.0
"""... in so many seconds."""
MOST_KNOWN = 4096
"""Whose tries are counted; those that tried last stay."""


class Attempts:
    """Counts what failed. A bucket for each key holds `MOST` tries, and is filled again in `PERIOD`."""

    def __init__(self, most: int = MOST, period: float = PERIOD) -> None:
        self._most, self._rate = most, most / period
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def wait(self, key: str, now: float) -> float:
        """Return for how long this one must wait before trying again [s]; 0 for not at all."""
        left = self._left_now(key, now)
        return 0.0 if left >= 1.0 else math.ceil((1.0 - left) / self._rate)

    def note(self, key: str, now: float) -> None:
        """Count a try, before it is decided: many at the same moment are many."""
        self._left[key] = max(0.0, self._left_now(key, now) - 1.0), now
        self._left.move_to_end(key)
        if len(self._left) > MOST_KNOWN:
            self._left.popitem(last=False)

    def forgive(self, key: str, now: float) -> None:
        """The try was right after all."""
        self._left[key] = min(float(self._most), self._left_now(key, now) + 1.0), now

    def _left_now(self, key: str, now: float) -> float:
        left, then = self._left.get(key, (float(self._most), now))
        return min(float(self._most), left + (now - then) * self._rate)


def network(address: str) -> str:
    """Return whose tries are counted together: an address, and of IPv6 the 64 bits that one household has."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    mapped = getattr(found, "ipv4_mapped", None)
    if mapped or found.version == 4:
        return str(mapped or found)
    return str(ipaddress.ip_network((found, 64), strict=False))
