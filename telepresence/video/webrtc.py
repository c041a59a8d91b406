"""Adapts aiortc to driving by camera: a chosen local address, loopback too, and no waiting for later packets.

aiortc hands out a picture when the first packet of the NEXT one arrives, which costs a whole period. RTP marks the last
packet of a picture, so `PromptJitterBuffer` need not wait. A packet of sound that is lost makes aiortc wait for sixteen
more, a hole of 0.24 s, and stay as late as that from then on; here a packet is given up when four later ones are there.
It overrides a private method, and only in the version of aiortc that it was written for; in any other pictures and
sound come as late as aiortc has them, and the log says so.
"""

from __future__ import annotations

import asyncio
import contextlib
import contextvars
import importlib.metadata
import logging
import socket
from collections.abc import Callable, Iterator
from typing import Any

import aioice.ice
import aiortc.rtcrtpreceiver
import av
import numpy as np
from aiortc import MediaStreamTrack, RTCConfiguration, RTCPeerConnection, VideoStreamTrack
from aiortc.jitterbuffer import JitterBuffer, JitterFrame
from aiortc.mediastreams import VIDEO_TIME_BASE, MediaStreamError
from aiortc.rtcrtpreceiver import RemoteStreamTrack

from telepresence.video import few_ports
from telepresence.video.bounded_decoding import bound_receivers
from telepresence.video.frame_timestamp import draw_time, strip_height
from telepresence.video.images import LatestImage

log = logging.getLogger(__name__)

KNOWN_VERSION = "1.16.0"
"""The version of aiortc that `PromptJitterBuffer` was written for."""
_ANY = range(0)
_own_address: contextvars.ContextVar[str | None] = contextvars.ContextVar("own_address", default=None)
_own_ports: contextvars.ContextVar[range] = contextvars.ContextVar("own_ports", default=_ANY)
_host_addresses = aioice.ice.get_host_addresses
_candidates = aioice.ice.Connection.get_component_candidates
OLDEST = 0.5
"""[s] since its arrival after which a picture is not sent any more: whoever receives it would take it for a new one."""
SERVER_PATIENCE = 0.5
"""[s] for which a STUN server may keep a connection waiting; aioice would wait ten times as long for a dead one."""


class PromptJitterBuffer(JitterBuffer):
    """Hands out a picture with its last packet, which carries RTP's marker bit (RFC 3550, 5.1; RFC 7741, 4.1), and
    sound as soon as `prefetch` later packets are there, whatever was lost before it."""

    def _remove_frame(self, sequence_number: int) -> JitterFrame | None:
        if not self._is_video:
            return self._remove_sound()
        frame = super()._remove_frame(sequence_number)
        if frame is not None:
            return frame
        packets: list[Any] = []  # aiortc adds `_data`, which its RtpPacket does not declare
        for packet in self._in_order():
            if packet is None:
                return None
            packets.append(packet)
            if packet.marker:
                self.remove(len(packets))
                return JitterFrame(b"".join(part._data for part in packets), packets[0].timestamp)
        return None

    def _remove_sound(self) -> JitterFrame | None:
        """Every packet of sound is a whole piece (RFC 7587, 4.2)."""
        present = [(n, packet) for n, packet in enumerate(self._in_order()) if packet is not None]
        if len(present) <= self._prefetch:
            return None
        first, packet = present[0]
        self.remove(first + 1)
        return JitterFrame(packet._data, packet.timestamp)

    def _in_order(self) -> Iterator[Any]:
        """Yield the packets from the oldest place on, None where one is missing."""
        if self._origin is not None:  # None before the first packet
            for count in range(self._capacity):
                yield self._packets[(self._origin + count) % self._capacity]


def release_early() -> bool:
    """Let every connection made from now on hand out pictures at once and sound whatever was lost; False if this aiortc
    is not the known one."""
    version = importlib.metadata.version("aiortc")
    if version != KNOWN_VERSION:
        log.warning(
            "aiortc is %s, not %s: every picture comes one period later than it could, sound a quarter of a second "
            "after the first loss",
            version,
            KNOWN_VERSION,
        )
        return False
    # The name by which aiortc's receivers make their buffers.
    aiortc.rtcrtpreceiver.JitterBuffer = PromptJitterBuffer  # type: ignore[misc]  # a class, replaced on purpose
    return True


def _addresses_to_offer(use_ipv4: bool, use_ipv6: bool) -> list[str]:
    address = _own_address.get()
    return _host_addresses(use_ipv4=use_ipv4, use_ipv6=use_ipv6) if address is None else [address]


async def _candidates_soon(connection: Any, component: int, addresses: list[str], timeout: float = 5.0) -> list[Any]:
    patience = min(timeout, SERVER_PATIENCE)
    found = await few_ports.candidates(connection, component, addresses, _own_ports.get(), patience)
    bound = {candidate.host for candidate in found}
    rest = [address for address in addresses if address not in bound]
    return found + await _candidates(connection, component, rest, patience)  # type: ignore[arg-type]


aioice.ice.get_host_addresses = _addresses_to_offer
aioice.ice.Connection.get_component_candidates = _candidates_soon  # type: ignore[method-assign, assignment]
bound_receivers()


@contextlib.contextmanager
def on_address(address: str | None, ports: range = _ANY) -> Iterator[None]:
    """Connections that gather their candidates within this block use one address of this machine, loopback allowed;
    None: all but loopback, as aioice has it. They use a free one of these ports, or any if there is none."""
    tokens = _own_address.set(address), _own_ports.set(ports)
    try:
        yield
    finally:
        _own_address.reset(tokens[0])
        _own_ports.reset(tokens[1])


def address_towards(host: str, port: int = 9) -> str:
    """Return this machine's address on the route to a host. It resolves the name, so it can take seconds.

    Raises:
        OSError: There is no way to it.
    """
    family, kind, _, _, target = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    with socket.socket(family, kind) as probe:
        probe.connect(target)  # sends nothing; asks the routing table
        return probe.getsockname()[0]


def peer_connection() -> RTCPeerConnection:
    """Return a connection that asks no server for its address: robot and pilot are in one network."""
    return RTCPeerConnection(RTCConfiguration(iceServers=[]))


class NewestPictureTrack(VideoStreamTrack):
    """Sends the newest picture of a source, each at most once; what the encoder has no time for is skipped, and so is
    what was there long before a receiver is, as the camera may give nothing any more.

    Args:
        source: Pictures as `planes_of` makes them, stamped with the time they were taken.
        with_time: Draw that time into the picture.
    """

    def __init__(self, source: LatestImage, with_time: bool = False) -> None:
        super().__init__()
        self._source = source
        self._with_time = with_time
        self._sequence = 0
        self._origin: float | None = None
        self._event_loop = asyncio.get_running_loop()
        self._news = asyncio.Event()
        source.add_listener(self._notify)

    def _notify(self) -> None:  # on the source's thread
        with contextlib.suppress(RuntimeError):  # the loop may have ended since
            self._event_loop.call_soon_threadsafe(self._news.set)

    async def recv(self) -> av.VideoFrame:
        while True:
            if self.readyState != "live":
                raise MediaStreamError
            picture = self._source.peek()
            if picture is not None and picture.sequence != self._sequence:
                self._sequence = picture.sequence
                if self._source.age() <= OLDEST:
                    break
            self._news.clear()
            await self._news.wait()
        planes = picture.content
        if self._with_time:
            planes = with_time(planes, picture.stamp)
        frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
        if self._origin is None:
            self._origin = picture.stamp
        frame.pts = round((picture.stamp - self._origin) / VIDEO_TIME_BASE)
        frame.time_base = VIDEO_TIME_BASE
        return frame

    def stop(self) -> None:
        if self.readyState == "live":
            self._source.remove_listener(self._notify)
        super().stop()
        self._news.set()


def planes_of(frame: av.VideoFrame) -> np.ndarray:
    """Return a picture as yuv420p: luma above quarter-size colours, shape (height * 3 / 2, width) uint8."""
    width, height = frame.width // 2 * 2, frame.height // 2 * 2
    return frame.reformat(width=width, height=height, format="yuv420p").to_ndarray()


def with_time(planes: np.ndarray, stamp: float) -> np.ndarray:
    """Return a copy with a time drawn into it; see `telepresence.video.frame_timestamp`."""
    planes = planes.copy()
    height, width = planes.shape[0] * 2 // 3, planes.shape[1]
    draw_time(planes[:height], stamp)
    colours = planes[height:].reshape(2, height // 2, width // 2)
    colours[:, -strip_height(width) // 2 :] = 128
    return planes


async def drain(track: MediaStreamTrack, take: Callable[[av.VideoFrame], None]) -> None:
    """Hand over every picture as it arrives, until the track ends; the newest where several wait."""
    while True:
        try:
            frame = await track.recv()
        except MediaStreamError:
            return
        if isinstance(track, RemoteStreamTrack) and track._queue.qsize() > 1:  # the end of the track may be the one
            continue
        if isinstance(frame, av.VideoFrame):  # a track that is not decoded would deliver packets
            take(frame)
