"""A program that speaks to the pilot's page by WebRTC, and sends pieces of messages on a channel that no browser would.

Beside them it shows, as a page does, that somebody is there.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import secrets
import time
from collections.abc import Callable
from typing import Any

from aiortc import RTCDataChannel, RTCPeerConnection, RTCSessionDescription
from aiortc.rtcsctptransport import SCTP_DATA_FIRST_FRAG, SCTP_DATA_LAST_FRAG, SCTP_DATA_UNORDERED, DataChunk
from page_stranger import Stranger, drive

from telepresence.video.webrtc import on_address, peer_connection

_SIZE = 1100
_AT_ONCE = 20
_PERIOD, _ALIVE = 0.01, 0.1
_PATIENCE = 30.0
_NO_PROTOCOL = 99
_WHOLE = SCTP_DATA_FIRST_FRAG | SCTP_DATA_LAST_FRAG | SCTP_DATA_UNORDERED


def _without_end(number: int, chunk: DataChunk) -> None:
    """The pieces of one message."""
    chunk.flags = 0 if number else SCTP_DATA_FIRST_FRAG


def _after_a_gap(number: int, chunk: DataChunk) -> None:
    """Whole messages of no kind, after one that never comes."""
    chunk.flags, chunk.protocol = _WHOLE, _NO_PROTOCOL
    chunk.tsn = (chunk.tsn + 1) % 2**32


def _on_many_streams(number: int, chunk: DataChunk) -> None:
    chunk.flags, chunk.protocol, chunk.stream_id = _WHOLE, _NO_PROTOCOL, 100 + number % 60_000


FLOODS: dict[str, Callable[[int, DataChunk], None]] = {
    "a message without end": _without_end,
    "messages after a gap": _after_a_gap,
    "messages on many streams": _on_many_streams,
}
"""Name -> makes the piece of this number."""


def is_hung_up_on(stranger: Stranger, cookie: str, flood: str, seconds: float) -> bool:
    """Whether the page hangs up within so many seconds."""
    return asyncio.run(_flood(stranger, cookie, FLOODS[flood], seconds))


async def _flood(stranger: Stranger, cookie: str, shape: Callable[[int, DataChunk], None], seconds: float) -> bool:
    peer = peer_connection()
    try:
        channel = await _connect(peer, stranger, cookie)
        sctp: Any = peer.sctp
        sequence = sctp._outbound_stream_seq.get(channel.id, 0)
        deadline, alive = time.monotonic() + seconds, 0.0
        for number in itertools.count():
            if peer.connectionState != "connected":
                return True
            if time.monotonic() > deadline:
                return False
            if time.monotonic() > alive + _ALIVE:
                alive = time.monotonic()
                channel.send(drive(number + 1, None).partition(" ")[2])
            chunk = DataChunk()
            chunk.tsn, sctp._local_tsn = sctp._local_tsn, (sctp._local_tsn + 1) % 2**32
            chunk.stream_id, chunk.stream_seq, chunk.protocol = channel.id, sequence, 51
            chunk.user_data = bytes(_SIZE)
            shape(number, chunk)
            await sctp._send_chunk(chunk)
            if number % _AT_ONCE == 0:
                await asyncio.sleep(_PERIOD)
    except ConnectionError:
        return True
    finally:
        await peer.close()
    raise AssertionError


async def _connect(peer: RTCPeerConnection, stranger: Stranger, cookie: str) -> RTCDataChannel:
    peer.addTransceiver("video", "recvonly")
    channel = peer.createDataChannel("drive", ordered=False, maxRetransmits=0)
    opened = asyncio.Event()
    channel.on("open", opened.set)
    with on_address(stranger.host):
        await peer.setLocalDescription(await peer.createOffer())
    body = {"robot": "Pepper", "page": secrets.token_hex(8), "attempt": 1, "sdp": peer.localDescription.sdp}
    status, answer, _ = await asyncio.to_thread(stranger.ask, "POST", "/offer", body, cookie)
    assert status == 200, answer
    await peer.setRemoteDescription(RTCSessionDescription(json.loads(answer)["sdp"], "answer"))
    async with asyncio.timeout(_PATIENCE):
        await opened.wait()
    return channel
