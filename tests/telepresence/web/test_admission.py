"""Connections are taken one by one, those that say nothing end, and who gives way when there is no room."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest

from telepresence.page.certificate import server_context
from telepresence.web.admission import ANYBODY, Admission, Limits, Standing

LIMITS = Limits(connections=48, per_party=12, first_request=5.0)


@pytest.fixture
def listening() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0), backlog=128) as made:
        yield made


def test_a_service_that_ends_while_somebody_connects_ends_quietly(listening: socket.socket) -> None:
    complaints: list[dict] = []

    async def scenario() -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: complaints.append(context))
        serving = asyncio.ensure_future(Admission(LIMITS).run(listening, asyncio.Protocol))
        await asyncio.sleep(0)  # it waits for the first connection now
        with socket.create_connection(listening.getsockname(), timeout=5.0):
            loop.call_soon(serving.cancel)  # before the loop finds the socket readable, in the same turn
            with contextlib.suppress(asyncio.CancelledError):
                await serving
        listening.close()
        await asyncio.sleep(0)

    asyncio.run(scenario())
    assert not complaints


def test_a_crowd_that_is_refused_leaves_the_loop_to_others(listening: socket.socket) -> None:
    served: list[asyncio.BaseTransport] = []

    class Served(asyncio.Protocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            served.append(transport)

    async def scenario(clients: contextlib.ExitStack) -> list[socket.socket]:
        def connect() -> socket.socket:
            return clients.enter_context(socket.create_connection(listening.getsockname(), timeout=5.0))

        admission = Admission(LIMITS)
        serving = asyncio.ensure_future(admission.run(listening, Served))
        for _ in range(LIMITS.per_party):
            connect()
        async with asyncio.timeout(20.0):
            while len(served) < LIMITS.per_party:
                await asyncio.sleep(0)
        await turns()
        for transport in served:
            admission.known(transport)  # they give way to nobody
        crowd = [connect() for _ in range(30)]
        await turns()
        waiting = [each for each in crowd if not is_closed(each)]
        serving.cancel()
        await asyncio.wait([serving], timeout=5.0)
        return waiting

    with contextlib.ExitStack() as clients:
        assert asyncio.run(scenario(clients)), "they were all refused before anybody else had a turn"


class Service:
    """A service with few places, on this event loop, and who connects to it."""

    def __init__(self, listening: socket.socket, limits: Limits, proxy: str = "") -> None:
        self.admission = Admission(limits, lambda address: ANYBODY if address == proxy else address)
        self.listening = listening
        self.transports: list[asyncio.BaseTransport] = []

    def __call__(self) -> asyncio.Protocol:
        made = self.transports

        class Served(asyncio.Protocol):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                made.append(transport)

        return Served()

    async def connect(self, address: str, standing: Standing = Standing.STRANGER) -> socket.socket:
        """Return the client's end of a connection that is served."""
        before = len(self.transports)
        client = socket.create_connection(self.listening.getsockname(), 5.0, (address, 0))
        await until(lambda: len(self.transports) > before)
        await turns()
        self.admission.known(self.transports[-1], standing)
        return client


def serve(service: Service, scenario: Callable[[], Awaitable[None]], folder: Path | None = None) -> None:
    async def run() -> None:
        tls = server_context(folder, ["127.0.0.1"]) if folder else None
        serving = asyncio.ensure_future(service.admission.run(service.listening, service, tls))
        try:
            await scenario()
        finally:
            serving.cancel()
            await asyncio.wait([serving])
            for transport in service.transports:
                transport.close()
            await turns()

    asyncio.run(run())


@pytest.mark.parametrize("encrypted", [False, True], ids=["plain", "before TLS's handshake"])
def test_a_connection_without_a_request_ends(listening, tmp_path, encrypted):
    service = Service(listening, Limits(connections=8, per_party=8, first_request=0.3))

    async def scenario() -> None:
        with socket.create_connection(listening.getsockname(), 5.0) as silent:
            await until(lambda: is_closed(silent))

    serve(service, scenario, tmp_path if encrypted else None)


def test_strangers_of_one_address_displace_their_own(listening):
    service = Service(listening, Limits(connections=8, per_party=3, first_request=60.0))

    async def scenario() -> None:
        other, signed_in = await service.connect("127.0.0.2"), await service.connect("127.0.0.1", Standing.SIGNED_IN)
        crowd = [await service.connect("127.0.0.1") for _ in range(6)]
        await until(lambda: [is_closed(each) for each in crowd] == [True] * 4 + [False] * 2)
        assert not is_closed(other) and not is_closed(signed_in)

    serve(service, scenario)


def test_without_room_strangers_give_way_first_and_who_is_kept_to_nobody(listening):
    service = Service(listening, Limits(connections=6, per_party=6, first_request=60.0))

    async def scenario() -> None:
        kept = [await service.connect("127.0.0.1", Standing.KEPT) for _ in range(2)]
        signed_in = await service.connect("127.0.0.2", Standing.SIGNED_IN)
        alone = await service.connect("127.0.0.3")
        crowd = [await service.connect("127.0.0.4") for _ in range(4)]
        await until(lambda: [is_closed(each) for each in crowd] == [True] * 2 + [False] * 2)
        assert not any(map(is_closed, (*kept, signed_in, alone)))
        for _ in range(3):
            kept.append(await service.connect("127.0.0.5", Standing.KEPT))
        await until(lambda: all(map(is_closed, (alone, *crowd))))
        assert not is_closed(signed_in)
        kept.append(await service.connect("127.0.0.5", Standing.KEPT))
        await until(lambda: is_closed(signed_in))
        with socket.create_connection(listening.getsockname(), 5.0) as refused:
            await until(lambda: is_closed(refused))
        assert not any(map(is_closed, kept))

    serve(service, scenario)


def test_a_proxys_connections_count_as_its_clients_while_it_asks_for_them(listening):
    service = Service(listening, Limits(connections=32, per_party=2, first_request=60.0), proxy="127.0.0.1")

    async def scenario() -> None:
        idle = [await service.connect("127.0.0.1") for _ in range(10)]
        assert not any(map(is_closed, idle)), "a proxy has no share of its own"
        for client, transport in zip("abbbaabb", service.transports, strict=False):
            service.admission.known(transport, Standing.STRANGER, client)
        await until(lambda: [is_closed(each) for each in idle] == [True] * 4 + [False] * 6)
        for transport in service.transports[4:]:
            service.admission.answered(transport)
        for transport in service.transports[4:]:
            service.admission.known(transport, Standing.STRANGER, "b")
            service.admission.answered(transport)
        assert not any(map(is_closed, idle[4:]))

    serve(service, scenario)


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(20.0):
        while not condition():
            await asyncio.sleep(0.005)


async def turns(count: int = 5) -> None:
    """Let the loop turn a few times."""
    for _ in range(count):
        await asyncio.sleep(0)


def is_closed(client: socket.socket) -> bool:
    client.setblocking(False)
    try:
        return client.recv(1) == b""
    except BlockingIOError:
        return False
    except ConnectionError:
        return True
