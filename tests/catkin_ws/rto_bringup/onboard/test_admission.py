"""Connections are taken one by one, and a service that ends in the moment in which somebody connects ends quietly."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Iterator

import pytest
from rto_bringup.onboard.admission import MAX_PER_ADDRESS, Admission


@pytest.fixture
def listening() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0), backlog=128) as made:
        yield made


def test_a_service_that_ends_while_somebody_connects_ends_quietly(listening: socket.socket) -> None:
    complaints: list[dict] = []

    async def scenario() -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: complaints.append(context))
        serving = asyncio.ensure_future(Admission(listening, asyncio.Protocol).run())
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

        admission = Admission(listening, Served)
        serving = asyncio.ensure_future(admission.run())
        for _ in range(MAX_PER_ADDRESS):
            connect()
        async with asyncio.timeout(20.0):
            while len(served) < MAX_PER_ADDRESS:
                await asyncio.sleep(0)
        await turns()
        for transport in served:
            admission.proven(transport)  # they give way to nobody
        crowd = [connect() for _ in range(30)]
        await turns()
        waiting = [each for each in crowd if not is_closed(each)]
        serving.cancel()
        await asyncio.wait([serving], timeout=5.0)
        return waiting

    with contextlib.ExitStack() as clients:
        assert asyncio.run(scenario(clients)), "they were all refused before anybody else had a turn"


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
