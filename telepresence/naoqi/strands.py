"""Which functions must not run side by side: the methods of one object, unless its class is `multiThreaded`.

Calls from outside, callbacks of signals and futures and `runAsync` share one strand per object, as in the vendor's
package. Functions that are no methods have none.
"""

from __future__ import annotations

import os
import threading
import types
import weakref
from collections.abc import Callable
from typing import Any

from .workers import Strand, submit

_lock = threading.Lock()
_strands: dict[int, tuple[weakref.ref[Any], Strand]] = {}


def strand_of(owner: object) -> Strand | None:
    """Return the strand of an object, None if it has none: its class is multiThreaded, or cannot be remembered."""
    if getattr(type(owner), "__qi_threading__", "single") == "multi":
        return None
    number = id(owner)
    with _lock:
        known = _strands.get(number)
        if known is not None and known[0]() is owner:
            return known[1]
        try:
            reference = weakref.ref(owner, lambda gone: _forget(number, gone))
        except TypeError:
            return None
        strand = Strand()
        _strands[number] = (reference, strand)
        return strand


def _forget(number: int, gone: weakref.ref[Any]) -> None:
    # A finalizer takes no lock. The number may belong to another object by now.
    known = _strands.get(number)
    if known is not None and known[0] is gone:
        del _strands[number]


def strand_for(function: Callable[..., Any]) -> Strand | None:
    """Return the strand of the object whose method this is, None for anything else."""
    owner = getattr(function, "__self__", None)
    if owner is None or isinstance(owner, (type, types.ModuleType)) or not isinstance(function, types.MethodType):
        return None
    return strand_of(owner)


def submit_for(function: Callable[..., Any], work: Callable[..., Any], *args: Any) -> None:
    """Run `work(*args)`, which calls `function`, on a worker; after what waits for the same object."""
    strand = strand_for(function)
    (submit if strand is None else strand.submit)(work, *args)


def _after_fork() -> None:
    global _lock
    _lock = threading.Lock()
    _strands.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
