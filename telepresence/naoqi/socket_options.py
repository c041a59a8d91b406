"""What the kernel is told about a connection, and is asked."""

from __future__ import annotations

import logging
import select
import socket
import struct

log = logging.getLogger(__name__)

_LAST_WORDS_MS = 3000
"""So long the kernel goes on sending what a closed connection had left [ms]: beyond it, an order is past."""
_DISCARD = struct.pack("ii", 1, 0)
"""SO_LINGER of zero seconds: closing throws away what the peer has not confirmed, and resets the connection."""
_HANG_UP = getattr(select, "POLLRDHUP", 0)
"""Linux reports it beside POLLHUP and POLLERR, which are always reported."""


def prepare(stream: socket.socket) -> None:
    """Set the options of a connection as libqi does: no delay, and a peer that is gone is noticed after 30 to 60 s.

    Raises: OSError: It is closed already.
    """
    stream.setblocking(False)
    stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 3), ("TCP_KEEPCNT", 10), ("TCP_USER_TIMEOUT", 30_000)):
        if hasattr(socket, name):
            stream.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def prepare_to_close(stream: socket.socket, discard: bool) -> None:
    """Limit what becomes of bytes that the peer has not confirmed.

    Args:
        discard: They are thrown away, and the connection is reset; else the kernel goes on sending them for a while.
    """
    try:
        if discard:
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _DISCARD)
        elif stream.family != socket.AF_UNIX and hasattr(socket, "TCP_USER_TIMEOUT"):
            stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _LAST_WORDS_MS)
    except OSError as error:
        log.debug("before closing: %s", error)


def has_hung_up(stream: socket.socket) -> bool:
    """Whether the peer has closed the connection, read or not."""
    poller = select.poll()
    poller.register(stream, _HANG_UP)
    return bool(poller.poll(0))
