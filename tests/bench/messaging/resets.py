"""Connections that are reset before they are accepted, ten thousand at a time, and the next client after them."""

from __future__ import annotations

import os
import selectors
import signal
import socket
import struct
import sys
import time
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

LINGER = struct.pack("ii", 1, 0)
"""close() sends a reset."""
HELLO = struct.pack("<4sIIHBBIII", b"\x42\xde\xad\x42", 2, 4, 0, 1, 0, 0, 0, 8) + bytes(4)
"""CALL 0.0.8 with an empty map: a login."""
PATIENCE = 30.0
BATCH, CONNECT = 100, 0.2
"""Connections that are reset while the server is stopped, fewer than the system queues for it; seconds for each."""
LISTENS = "0A"
"""A listener's state in /proc/net/tcp."""


class Resets(NamedTuple):
    """What each round of resets left behind."""

    seconds: list[float]
    """Seconds until a new client's login was answered."""
    memory: list[float]
    """The server's memory [MB]."""
    descriptors: list[int]
    threads: list[int]
    connected: list[int]

    @property
    def in_time(self) -> int:
        return sum(seconds < 1.0 for seconds in self.seconds)


def reset(host: str, port: int, count: int, pid: int) -> int:
    """Open and reset `count` connections, in batches while the server is stopped; how many were connected at all.

    Between batches the server empties the system's queue, or nobody could connect; after the last it has not.
    """
    connected = 0
    for begin in range(0, count, BATCH):
        deadline = time.monotonic() + PATIENCE
        while begin and waiting(port):
            if time.monotonic() > deadline:
                raise RuntimeError("the server accepts nobody any more")
            time.sleep(0.0005)
        os.kill(pid, signal.SIGSTOP)
        try:
            connected += sum(connect_and_reset(host, port) for _ in range(min(BATCH, count - begin)))
        finally:
            os.kill(pid, signal.SIGCONT)
    return connected


def waiting(port: int) -> int:
    """Connections that the system holds for a listener on IPv4 until it accepts them."""
    for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
        _, local, _, state, queues = line.split()[:5]
        if state == LISTENS and int(local.rpartition(":")[2], 16) == port:
            return int(queues.rpartition(":")[2], 16)
    return 0


def connect_and_reset(host: str, port: int) -> bool:
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, LINGER)
        connection.settimeout(CONNECT)
        try:
            connection.connect((host, port))
        except OSError:  # the system's queue is full
            return False
    return True


def served_after(host: str, port: int) -> float:
    """Seconds until a new client has the answer to its login."""
    begin = time.monotonic()
    with (
        socket.create_connection((host, port), timeout=PATIENCE) as connection,
        selectors.DefaultSelector() as selector,
    ):
        connection.sendall(HELLO)
        selector.register(connection, selectors.EVENT_READ)
        if not selector.select(PATIENCE) or len(connection.recv(28)) < 28:
            raise RuntimeError("the server answers nobody any more")
    return time.monotonic() - begin


def usage(pid: int) -> tuple[float, int, int]:
    """Memory [MB], descriptors and threads of a process."""
    words = Path(f"/proc/{pid}/statm").read_text().split()
    memory = int(words[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    return memory, len(os.listdir(f"/proc/{pid}/fd")), len(os.listdir(f"/proc/{pid}/task"))


def settled(pid: int, descriptors: int) -> tuple[float, int, int]:
    """The usage when the connections of before are gone, or after a few seconds."""
    deadline = time.monotonic() + 10.0
    while (found := usage(pid))[1] > descriptors and time.monotonic() < deadline:
        time.sleep(0.02)
    return found


def reset_rounds(url: str, pid: int, times: int, count: int, progress: bool = True) -> Resets:
    """Each round: `count` resets, then at once a new client; then what the server still holds of them."""
    parts = urlsplit(url)
    host, port = parts.hostname or "", parts.port or 0
    served_after(host, port)
    result = Resets([], [], [], [], [])
    before = usage(pid)[1]
    for number in range(times):
        result.connected.append(reset(host, port, count, pid))
        result.seconds.append(served_after(host, port))
        memory, descriptors, threads = settled(pid, before)
        result.memory.append(memory)
        result.descriptors.append(descriptors)
        result.threads.append(threads)
        if progress:
            line = f"round {number + 1} of {times}: {result.connected[-1]} resets, then served after"
            line += f" {result.seconds[-1] * 1e3:.1f} ms, {memory:.1f} MB, {descriptors} descriptors"
            print(line, file=sys.stderr, flush=True)
    return result
