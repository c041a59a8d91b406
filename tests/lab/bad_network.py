"""A UDP wire that loses, delays and swaps packets, and can be cut; loopback only."""

from __future__ import annotations

import heapq
import itertools
import random
import socket
import threading
import time


class BadNetwork:
    """Relays packets from `port` to a port of this machine until closed.

    Args:
        target: UDP port.
        loss: Share of packets that vanish.
        jitter: Each packet is held back for a random time up to this [s], so that some overtake others.
        seed: Start of the random sequence.
    """

    def __init__(self, target: int, loss: float = 0.02, jitter: float = 0.05, seed: int = 1) -> None:
        self.cut = False
        """While true, nothing gets through."""
        self.received = self.lost = 0
        self._target = ("127.0.0.1", target)
        self._loss, self._jitter = loss, jitter
        self._random = random.Random(seed)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.2)
        self.port = self._socket.getsockname()[1]
        self._due: list[tuple[float, int, bytes]] = []
        self._numbers = itertools.count()
        self._changed = threading.Condition()
        self._closed = False
        self._threads = [threading.Thread(target=run, daemon=True) for run in (self._take, self._give)]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        for thread in self._threads:
            thread.join(2.0)
        self._socket.close()

    def _take(self) -> None:
        while not self._closed:
            try:
                packet = self._socket.recv(65536)
            except TimeoutError:
                continue
            except ConnectionError:
                continue  # nobody listens at the target yet
            self.received += 1
            if self.cut or self._random.random() < self._loss:
                self.lost += 1
                continue
            with self._changed:
                due = time.monotonic() + self._random.random() * self._jitter
                heapq.heappush(self._due, (due, next(self._numbers), packet))
                self._changed.notify()

    def _give(self) -> None:
        with self._changed:
            while not self._closed:
                wait = self._due[0][0] - time.monotonic() if self._due else None
                if wait is None or wait > 0.0:
                    self._changed.wait(wait)
                    continue
                packet = heapq.heappop(self._due)[2]
                try:
                    self._socket.sendto(packet, self._target)
                except ConnectionError:
                    pass  # as in _take: ICMP's answer to an earlier packet
