"""The clocks of the vendor's package, in nanoseconds."""

from __future__ import annotations

import time


def clockNow() -> int:
    """Return a time that only grows [ns]."""
    return time.monotonic_ns()


def steadyClockNow() -> int:
    """Return a time that only grows, in the same unit as `clockNow` [ns]."""
    return time.monotonic_ns()


def systemClockNow() -> int:
    """Return the time of day, since 1970 [ns]."""
    return time.time_ns()
