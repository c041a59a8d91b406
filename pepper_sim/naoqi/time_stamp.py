"""Time stamps as NAOqi writes them."""

from __future__ import annotations


def split_stamp(stamp: float) -> list[int]:
    """Return [whole seconds, microseconds] of a time [s since 1970], as NAOqi writes time stamps."""
    return [int(stamp), int(stamp % 1 * 1e6)]
