# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
"""A clock that nobody can set. Python 2.7 has none, but Linux does."""

import time

MYPY = False
if MYPY:
    from typing import Callable  # noqa: F401, UP035


def _linux_clock():
    # type: () -> Callable[[], float]
    """CLOCK_MONOTONIC of the C library; raises OSError or AttributeError without one."""
    import ctypes

    class Timespec(ctypes.Structure):
        _fields_ = [("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long)]  # noqa: RUF012

    get = ctypes.CDLL("librt.so.1", use_errno=True).clock_gettime
    now = Timespec()
    pointer = ctypes.byref(now)

    def read():
        # type: () -> float
        if get(1, pointer) != 0:
            raise OSError(ctypes.get_errno(), "clock_gettime failed")
        return now.seconds + now.nanoseconds * 1e-9

    read()
    return read


monotonic = getattr(time, "monotonic", None) or _linux_clock()  # type: Callable[[], float]
"""Seconds since some moment."""
