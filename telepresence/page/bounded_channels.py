"""Bounds what a browser's channels may cost, in aiortc's SCTP: it keeps pieces of messages for as long as they come.

A message that never ends fills the memory, whatever the window says that aiortc announces; so do gaps that are never
filled, and streams that nobody opened; and each further piece is looked for among all that wait. A page's messages fit
one packet, and few of them wait for one that was lost.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from aiortc import RTCSctpTransport
from aiortc.rtcsctptransport import DataChunk

from telepresence.page.browser_messages import MOST_PER_SECOND
from telepresence.page.commands import LONGEST

MOST_HELD = 512
"""Pieces that wait for others: more than a page sends in a cut, after which it is given up."""
MOST_BYTES = 64 * LONGEST
"""Bytes of those."""
MOST_STREAMS = 64
"""Streams: several times as many as a page has channels."""
MOST_PIECES = 5 * MOST_PER_SECOND
"""Pieces in a second, those that come twice among them."""


def bound_channels(transport: RTCSctpTransport, exceeded: Callable[[str], None]) -> None:
    """Let a connection receive within these bounds.

    Args:
        exceeded: Told, once, what came that no page sends; from then on nothing more is received.
    """
    receive = transport._receive_data_chunk  # no public name, nor have the parts below
    begun, pieces, over = time.monotonic(), 0, False

    async def receive_bounded(chunk: DataChunk) -> None:
        nonlocal begun, pieces, over
        if over:
            return
        now = time.monotonic()
        if now - begun >= 1.0:
            begun, pieces = now, 0
        pieces += 1
        await receive(chunk)
        if excess := f"{MOST_PIECES} pieces in a second" if pieces > MOST_PIECES else _excess(transport):
            over = True
            exceeded(f"more than {excess}")

    transport._receive_data_chunk = receive_bounded  # type: ignore[method-assign]


def _excess(transport: RTCSctpTransport) -> str:
    """Return what of it is too much; empty for nothing."""
    streams = transport._inbound_streams.values()
    if len(streams) > MOST_STREAMS:
        return f"{MOST_STREAMS} streams"
    held = sum(len(stream.reassembly) for stream in streams)
    if max(held, len(transport._sack_misordered)) > MOST_HELD:
        return f"{MOST_HELD} pieces that wait for others"
    if sum(len(chunk.user_data) for stream in streams for chunk in stream.reassembly) > MOST_BYTES:
        return f"{MOST_BYTES} bytes that wait for others"
    return ""
