"""The socket that a web server listens on. Standard library only: it may be opened long before the server starts."""

from __future__ import annotations

import contextlib
import socket
from pathlib import Path

SEND_BUFFER = 65536
"""Bytes asked for in the kernel per viewer (Linux doubles it): at 640x480 a reader of 600 kB/s sees pictures 0.4 s old
instead of 5.6 s with default buffers, and a fast one still gets 6 MB/s at 20 ms round trip."""

BACKLOG = 1024
"""Connections that may wait to be taken: a burst waits in the queue instead of being asked to come again."""


def listener(address: str, port: int, send_buffer: int | None = SEND_BUFFER) -> socket.socket:
    """Return a listening TCP socket whose connections hold little unsent data and do not wait to fill packets.

    Args:
        address: Of one interface; "0.0.0.0" or "::" for all of them.
        port: 0 picks a free one.
        send_buffer: Bytes; None leaves them to the kernel.
    Raises:
        OSError: The port is taken or the address is not this machine's; the text names both.
    """
    try:
        family, kind, protocol, _, target = socket.getaddrinfo(address, port, type=socket.SOCK_STREAM)[0]
        with contextlib.ExitStack() as undone:
            listening = undone.enter_context(socket.socket(family, kind, protocol))
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            # Accepted connections inherit both. Without TCP_NODELAY the body of a long poll waits for its header's ACK.
            if send_buffer is not None:
                listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, send_buffer)
            listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            listening.bind(target)
            listening.listen(BACKLOG)
            undone.pop_all()
    except OSError as error:
        raise OSError(error.errno, f"cannot listen on {address}, port {port}: {error.strerror}") from error
    return listening


def unix_listener(file: Path) -> socket.socket:
    """Return a listening unix socket in place of one that a program before has left behind.

    Raises:
        OSError: The file cannot be made; the text names it.
    """
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        if file.is_socket():
            file.unlink()
        listening.bind(str(file))
        listening.listen(BACKLOG)
    except OSError as error:
        listening.close()
        raise OSError(error.errno, f"cannot listen on {file}: {error.strerror}") from error
    return listening
