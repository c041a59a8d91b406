"""How browsers reach the page's application, and how many may at once, whatever strangers do.

A connection that has not signed in counts as its address's, or behind a proxy as the browser's for which the proxy
asks; one that has, as that sign-in's. Strangers give way first, and a websocket, which carries commands, to nobody. A
quarter of the program's files at most are theirs: WebRTC and ROS need the others.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
from collections.abc import AsyncIterator

from aiohttp import web

from telepresence.page.attempts import network
from telepresence.page.proxy import Proxy
from telepresence.web.admission import ANYBODY, Admission, Limits
from telepresence.web.request_log import request_log

FIRST_REQUEST = 2.0
"""[s] for TLS's handshake and the first lines of a request."""
LIMITS = Limits(connections=256, per_party=32, first_request=FIRST_REQUEST)
"""A browser opens six connections at most; a household has several browsers."""


def page_admission(proxy: Proxy | None) -> Admission:
    """Return what admits browsers."""
    return Admission(LIMITS, lambda peer: ANYBODY if proxy is not None and proxy.sent(peer) else network(peer))


@contextlib.asynccontextmanager
async def serving(
    application: web.Application, admission: Admission, listening: socket.socket, tls: ssl.SSLContext | None = None
) -> AsyncIterator[asyncio.Task]:
    """Serve an application within this block, and close the socket after it.

    Yields:
        What takes the connections: done only if it has failed.
    """
    runner = web.AppRunner(application, access_log=None, logger=request_log(__name__), handle_signals=False)
    await runner.setup()
    assert runner.server is not None, "setup has made it"
    taking = asyncio.ensure_future(admission.run(listening, runner.server, tls))
    try:
        yield taking
    finally:
        taking.cancel()
        await asyncio.wait([taking])
        listening.close()
        await runner.cleanup()
