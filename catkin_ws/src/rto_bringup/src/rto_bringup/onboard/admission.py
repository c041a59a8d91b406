"""Who may be connected to a service of the robot: few at a time, each for a short while, whatever strangers do.

Half a request holds its connection for `HEADER_TIMEOUT` at most. When there is no room, the oldest connection that has
proven nothing gives way: first one of the newcomer's own address, then one of the address that has most.
"""

from __future__ import annotations

import asyncio
import collections
import errno
import logging
import resource
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from telepresence.station import heartbeat

log = logging.getLogger(__name__)

MAX_CONNECTIONS = 48
MAX_PER_ADDRESS = 12
HEADER_TIMEOUT = 2.0
"""Seconds within which a connection brings a request's first lines."""
CONNECTION_TIMEOUT = 10.0
"""Seconds after which a connection ends, whatever comes over it: an exchange takes one."""
MAX_REQUESTS = 4
"""Over one connection: an exchange takes two."""
FROZEN_AFTER = 2.0
"""Seconds after which a program whose loop does not turn counts as frozen; a camera may take a while to open."""
SWEEP_PERIOD = 0.25
"""Seconds between two looks at what is connected."""
ACCEPT_PAUSE = 0.2
"""Seconds until the next connection when none can be taken: no file is left, or no memory."""


@dataclass(eq=False)
class _Connection:
    address: str
    transport: asyncio.Transport
    since: float
    requests: int = 0
    proven: bool = False


class Admission:
    """Takes the connections of one listening socket. All of it belongs to one event loop.

    Args:
        listening: Bound and listening; closed by its owner.
        protocol: Makes what serves a connection.
    """

    def __init__(self, listening: socket.socket, protocol: Callable[[], asyncio.Protocol]) -> None:
        listening.setblocking(False)
        self._listening = listening
        self._protocol = protocol
        self._connections: dict[asyncio.BaseTransport | None, _Connection] = {}
        """Open connections, in the order in which they came."""
        files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        self._most = max(4, min(MAX_CONNECTIONS, files // 4 if files > 0 else MAX_CONNECTIONS))

    async def run(self) -> None:
        """Take connections until cancelled."""
        sweeping = asyncio.ensure_future(self._sweep())
        try:
            while True:
                await self._take()
        finally:
            sweeping.cancel()

    def asked(self, transport: asyncio.BaseTransport | None) -> bool:
        """A request came over it; whether another one may."""
        connection = self._connections.get(transport)
        if connection is None:
            return False
        connection.requests += 1
        return connection.requests < MAX_REQUESTS

    def proven(self, transport: asyncio.BaseTransport | None) -> None:
        """Who is at its other end may be served: it gives way to nobody."""
        connection = self._connections.get(transport)
        if connection is not None:
            connection.proven = True

    async def _take(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            taken, peer = await self._accept()
        except OSError as error:
            aborted = error.errno == errno.ECONNABORTED
            if not aborted:
                log.error("no connection can be taken: %s", error.strerror)
                self._give_way(None)
            await asyncio.sleep(0 if aborted else ACCEPT_PAUSE)
            return
        address = str(peer[0])
        if not self._make_room(address):
            taken.close()
            await asyncio.sleep(0)  # a crowd of strangers must not keep the loop
            return
        try:
            transport, _ = await loop.connect_accepted_socket(self._protocol, taken)
        except OSError as error:
            log.debug("a connection from %s is gone: %s", address, error)
            taken.close()
            return
        self._connections[transport] = _Connection(address, transport, loop.time())

    async def _accept(self) -> tuple[socket.socket, Any]:
        """Do the same as `loop.sock_accept`, which must not be cancelled in Python 3.11: when somebody connects in the
        same turn of the loop, it takes the connection, loses it, and prints a traceback."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                return self._listening.accept()
            except BlockingIOError:
                pass
            somebody = asyncio.Event()
            loop.add_reader(self._listening, somebody.set)
            try:
                await somebody.wait()
            finally:
                loop.remove_reader(self._listening)

    async def _sweep(self) -> None:
        """End what takes too long. One look at few, no timer for each: strangers may have many ended."""
        loop = asyncio.get_running_loop()
        while True:
            heartbeat.beat(FROZEN_AFTER)
            await asyncio.sleep(SWEEP_PERIOD)
            for each in self._connections.values():
                age = loop.time() - each.since
                if age > CONNECTION_TIMEOUT or (age > HEADER_TIMEOUT and not each.requests):
                    each.transport.abort()

    def _make_room(self, address: str) -> bool:
        self._connections = {at: each for at, each in self._connections.items() if not each.transport.is_closing()}
        if sum(each.address == address for each in self._connections.values()) >= MAX_PER_ADDRESS:
            return self._give_way(address)
        return len(self._connections) < self._most or self._give_way(None)

    def _give_way(self, address: str | None) -> bool:
        """End the oldest that has proven nothing, of one address or of the one that has most; False: there is none."""
        idle = [each for each in self._connections.values() if not each.proven]
        if not idle:
            return False
        if address is None:
            address = collections.Counter(each.address for each in idle).most_common(1)[0][0]
        oldest = next((each for each in idle if each.address == address), None)
        if oldest is None:
            return False
        del self._connections[oldest.transport]
        oldest.transport.abort()
        return True
