"""A program's sign of life, as systemd defines it (sd_notify(3)): a datagram `WATCHDOG=1` to the unix socket that the
environment variable NOTIFY_SOCKET names. Standard library only.

Whoever started the program (`telepresence_ros.roslaunch`, `./stack up`, systemd) ends and restarts it when the beats
stop. So a program beats from the loop that does its work, never from a thread of its own:

    while working:
        heartbeat.beat()
        ...

Without NOTIFY_SOCKET nothing is sent. The first sign takes the variable out of the environment: programs that this one
starts are not watched in its name. A program that beats by itself, as `telepresence.drive.server` does, still finds it.
"""

from __future__ import annotations

import os
import socket
import threading
import time

PERIOD = 0.1
"""Seconds between two datagrams at least."""
WITHIN = 0.5
"""Seconds within which the next beat is due, unless `beat` was told otherwise."""

_address = os.environ.get("NOTIFY_SOCKET", "")
_socket: socket.socket | None = None
_due: dict[int, float] = {}
"""Thread of each loop -> time at which its next beat is due."""
_sent_at = -PERIOD
_sent_within = WITHIN


def beat(within: float = WITHIN) -> None:
    """Say that the loop which calls this works; cheap enough for every cycle, and it never raises.

    When a program has several loops (threads that have beaten and not said `rest`), it counts as alive while none of
    them is late.

    Args:
        within: Seconds in which the next beat comes at the latest: more than usual before a call that may wait, for an
            answer from the network for example.
    """
    global _sent_at, _sent_within
    if not _address:
        return
    now = time.monotonic()
    _due[threading.get_ident()] = now + within
    due = list(_due.values())  # a copy: other threads beat too
    if min(due) < now:
        return
    # What the watcher is told must hold for every loop.
    longest = max(max(due) - now, WITHIN)
    if now < _sent_at + PERIOD and longest <= _sent_within:
        return
    _sent_at, _sent_within = now, longest
    notify("WATCHDOG=1" if longest <= WITHIN else f"WATCHDOG=1\nWATCHDOG_USEC={round(longest * 1e6)}")


def rest() -> None:
    """The loop of this thread ends, or waits for as long as it likes: it is not watched until it beats again."""
    _due.pop(threading.get_ident(), None)


def notify(text: str) -> None:
    """Send one datagram of sd_notify(3), such as `READY=1`; nothing without NOTIFY_SOCKET. Never raises."""
    global _socket
    if not _address:
        return
    try:
        if _socket is None:
            os.environ.pop("NOTIFY_SOCKET", None)
            _socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK)
        # By address every time: a watcher that was restarted listens at the same place with another socket.
        _socket.sendto(text.encode(), "\0" + _address[1:] if _address.startswith("@") else _address)
    except OSError:
        return  # nobody listens now, or its queue is full of beats: neither is a reason to stop working
