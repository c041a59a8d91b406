"""Who may be connected to a service on an event loop: few at a time, whatever strangers do.

Each connection belongs to a *party*: at first the address that it comes from; then, as the service finds out, the
client for whom a proxy asks, or the person who has signed in. A connection without a first request ends after a short
while, TLS's handshake included. When there is no room, the oldest connection that has proven nothing gives way: first
one of the newcomer's own party, then one of the party that has most.
"""

from __future__ import annotations

import asyncio
import collections
import enum
import errno
import logging
import math
import resource
import socket
import ssl
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

log = logging.getLogger(__name__)

ANYBODY = ""
"""The party of connections that may become anybody's: a proxy's. It has no share of its own."""
SWEEP_PERIOD = 0.25
"""Seconds between two looks at what is connected."""
ACCEPT_PAUSE = 0.2
"""Seconds until the next connection when none can be taken: no file is left, or no memory."""
END_TIMEOUT = 1.0
"""Seconds for handshakes that go on when the service ends."""


@dataclass(frozen=True)
class Limits:
    """What connections may cost.

    Attributes:
        connections: Open at the same time; of the files that the program may open they get a quarter at most.
        per_party: Of these, those of one party.
        first_request: Within this time a connection brings a request's first lines, TLS's handshake included [s].
        lasts: After this time a connection ends, whatever comes over it [s].
        requests: Over one connection.
    """

    connections: int
    per_party: int
    first_request: float
    lasts: float = math.inf
    requests: float = math.inf


class Standing(enum.IntEnum):
    """What a connection has shown; those of a lower one give way first."""

    STRANGER = 0
    SIGNED_IN = 1
    KEPT = 2
    """It gives way to nobody."""


class _Connection:
    def __init__(self, taken: socket.socket, party: str, since: float) -> None:
        self.socket, self.party, self.since = taken, party, since
        self.origin = party
        self.transport: asyncio.Transport | None = None
        """None until TLS's handshake is over."""
        self.standing = Standing.STRANGER
        self.requests = 0
        self.ended = False

    @property
    def open(self) -> bool:
        """Whether it still has a file."""
        return self.socket.fileno() >= 0

    def end(self) -> None:
        """Close it. In the handshake the transport is asyncio's own, and finds that the other end has gone."""
        self.ended = True
        if self.transport is not None:
            self.transport.abort()
            return
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except OSError:  # the peer was quicker
            return


class Admission:
    """Takes the connections of one listening socket. All of it belongs to one event loop.

    Args:
        party_of: The party of an address, "" for that of a unix socket; by default every address is one.
    """

    def __init__(self, limits: Limits, party_of: Callable[[str], str] = str) -> None:
        self._limits, self._party_of = limits, party_of
        self._connections: dict[int, _Connection] = {}
        """By the number of their file, whoever waits longest first."""
        self._starting: set[asyncio.Task] = set()
        files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        self._most = max(4, min(limits.connections, files // 4 if files > 0 else limits.connections))

    async def run(
        self,
        listening: socket.socket,
        protocol: Callable[[], asyncio.Protocol],
        tls: ssl.SSLContext | None = None,
    ) -> None:
        """Take connections until cancelled.

        Args:
            listening: Bound and listening; closed by its owner.
            protocol: Makes what serves a connection.
        """
        listening.setblocking(False)
        sweeping = asyncio.ensure_future(self._sweep())
        try:
            while True:
                await self._take(listening, protocol, tls)
        finally:
            sweeping.cancel()
            if self._starting:
                for each in self._connections.values():
                    if each.transport is None:
                        each.end()
                await asyncio.wait(self._starting, timeout=END_TIMEOUT)

    def asked(self, transport: asyncio.BaseTransport | None) -> bool:
        """A request came over it; whether another one may."""
        connection = self._of(transport)
        if connection is None:
            return False
        connection.requests += 1
        number = connection.socket.fileno()
        self._connections[number] = self._connections.pop(number)  # among those that wait it is the newest
        return connection.requests < self._limits.requests

    def known(
        self, transport: asyncio.BaseTransport | None, standing: Standing = Standing.KEPT, party: str | None = None
    ) -> None:
        """Note who is at its other end; if that party has more than its share now, its oldest other one gives way.

        Args:
            party: None: that to which it has belonged.
        """
        connection = self._of(transport)
        if connection is None:
            return
        connection.standing = standing
        if party is None or party == connection.party:
            return
        connection.party = party
        others = [each for each in self._of_party(party) if each is not connection]
        if len(others) >= self._limits.per_party and party != ANYBODY:
            self._give_way(others)

    def answered(self, transport: asyncio.BaseTransport | None) -> None:
        """The request is over: what a proxy holds open may be anybody's again."""
        connection = self._of(transport)
        if connection is not None and connection.origin == ANYBODY:
            self.known(transport, Standing.STRANGER, ANYBODY)

    def _of(self, transport: asyncio.BaseTransport | None) -> _Connection | None:
        found = transport.get_extra_info("socket") if transport is not None else None
        return None if found is None else self._connections.get(found.fileno())

    async def _take(
        self, listening: socket.socket, protocol: Callable[[], asyncio.Protocol], tls: ssl.SSLContext | None
    ) -> None:
        try:
            taken, peer = await _accept(listening)
        except OSError as error:
            aborted = error.errno == errno.ECONNABORTED
            if not aborted:
                log.error("no connection can be taken: %s", error.strerror)
                self._give_way(self._connections.values())
            await asyncio.sleep(0 if aborted else ACCEPT_PAUSE)
            return
        party = self._party_of(str(peer[0]) if isinstance(peer, tuple) else "")
        if self._make_room(party):
            connection = _Connection(taken, party, asyncio.get_running_loop().time())
            self._connections[taken.fileno()] = connection
            starting = asyncio.ensure_future(_start(connection, protocol, tls))
            self._starting.add(starting)
            starting.add_done_callback(self._starting.discard)
        else:
            taken.close()
        await asyncio.sleep(0)  # a crowd of strangers must not keep the loop

    async def _sweep(self) -> None:
        """End what takes too long. One look at few, no timer for each: strangers may have many ended."""
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(SWEEP_PERIOD)
            for each in self._connections.values():
                age = loop.time() - each.since
                if age > self._limits.lasts or (age > self._limits.first_request and not each.requests):
                    each.end()

    def _make_room(self, party: str) -> bool:
        self._connections = {number: each for number, each in self._connections.items() if each.open}
        own = self._of_party(party)
        if len(own) >= self._limits.per_party and party != ANYBODY:
            return self._give_way(own)
        return len(self._connections) < self._most or self._give_way(self._connections.values())

    def _of_party(self, party: str) -> list[_Connection]:
        return [each for each in self._connections.values() if each.party == party and each.open]

    def _give_way(self, among: Iterable[_Connection]) -> bool:
        """End the one that waits longest, of the party that has most, strangers first; False: there is none."""
        candidates = list(among)
        for standing in (Standing.STRANGER, Standing.SIGNED_IN):
            found = [each for each in candidates if each.standing is standing]
            if found:
                party = collections.Counter(each.party for each in found).most_common(1)[0][0]
                oldest = next(each for each in found if each.party == party)
                self._connections.pop(oldest.socket.fileno(), None)
                oldest.end()
                return True
        return False


async def _start(connection: _Connection, protocol: Callable[[], asyncio.Protocol], tls: ssl.SSLContext | None) -> None:
    loop = asyncio.get_running_loop()
    try:
        transport, _ = await loop.connect_accepted_socket(protocol, connection.socket, ssl=tls)
    except OSError as error:
        log.debug("a connection of %s is gone: %s", connection.party, error)
        connection.socket.close()
        return
    connection.transport = transport
    if connection.ended:
        transport.abort()


async def _accept(listening: socket.socket) -> tuple[socket.socket, Any]:
    """Do the same as `loop.sock_accept`, which must not be cancelled in Python 3.11: when somebody connects in the
    same turn of the loop, it takes the connection, loses it, and prints a traceback."""
    loop = asyncio.get_running_loop()
    while True:
        try:
            return listening.accept()
        except BlockingIOError:
            pass
        somebody = asyncio.Event()
        loop.add_reader(listening, somebody.set)
        try:
            await somebody.wait()
        finally:
            loop.remove_reader(listening)
