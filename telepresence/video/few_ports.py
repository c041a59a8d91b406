"""UDP ports that WebRTC may use where not all lead outside; aioice takes whatever port Linux gives."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Iterable
from functools import partial
from typing import Any

from aioice import turn
from aioice.candidate import Candidate, candidate_foundation, candidate_priority
from aioice.ice import StunProtocol, server_reflexive_candidate
from aioice.stun import TransactionError


async def candidates(
    connection: Any, component: int, addresses: Iterable[str], ports: range, timeout: float
) -> list[Candidate]:
    """Open the first free one of these ports at each address, and return what there is to offer.

    Args:
        connection: aioice's, which owns the sockets from now on.
        component: Of the connection.
        addresses: Of this machine; one where every port is taken gives none.
        timeout: [s] for the STUN server to say how we look from outside.
    """
    found = []
    for address in addresses:
        protocol = await _open(connection, address, ports)
        if protocol is None:
            continue
        own = protocol.local_candidate = Candidate(
            foundation=candidate_foundation("host", "udp", address),
            component=component,
            transport="udp",
            priority=candidate_priority(component, "host"),
            host=address,
            port=protocol.transport.get_extra_info("sockname")[1],
            type="host",
        )
        connection._protocols.append(protocol)
        found.append(own)
        if connection.stun_server:
            with contextlib.suppress(OSError, TimeoutError, TransactionError):
                asked = server_reflexive_candidate(protocol, connection.stun_server)
                outside, _ = await asyncio.wait_for(asked, timeout)
                found.append(outside)
    return found


async def _open(connection: Any, address: str, ports: range) -> Any:
    loop = asyncio.get_running_loop()
    for port in ports:
        with contextlib.suppress(OSError):  # another browser has it
            transport, protocol = await loop.create_datagram_endpoint(
                partial(StunProtocol, connection), local_addr=(address, port)
            )
            transport.get_extra_info("socket").setsockopt(
                socket.SOL_SOCKET, socket.SO_RCVBUF, turn.UDP_SOCKET_BUFFER_SIZE
            )
            return protocol
    return None
