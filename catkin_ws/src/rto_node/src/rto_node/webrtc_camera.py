"""WebrtcCamera: the newest picture of a camera sender, over connections that are made anew as often as needed. No ROS.

    POST http://HOST:PORT/camera[?time=1]   see `rto_node.signaling_client`

Nothing is believed about a connection's state, which aiortc calls "connected" for 28 s after the sender's death: when
no new picture has come for a second, it is given up and made anew. Nor is the first picture of a connection believed to
be new: without a time in it, one that a sender has kept of a dead camera looks like any other. The second one is.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import threading
import time
from collections.abc import Callable
from urllib.parse import urlsplit

import aiohttp
import av
from aiortc import MediaStreamTrack, RTCPeerConnection, RTCSessionDescription
from aiortc.contrib.signaling import BYE

from rto_node.signaling_client import Refused, SignalingClient
from telepresence import ports
from telepresence.video.copy_paste_signaling import (
    EXITING,
    CopyPasteSignaling,
    Message,
    connected,
    follow,
    take_description,
)
from telepresence.video.frame_timestamp import read_age
from telepresence.video.images import LatestImage
from telepresence.video.webrtc import drain, on_address, peer_connection

log = logging.getLogger(__name__)

LOST_AFTER = 1.0
"""Seconds without a new picture after which the connection is made anew."""
FIRST_PICTURE = 2.5
"""Seconds within which a new connection must bring its first picture: a camera may have to wake up."""
RETRY_PERIOD = 0.3
"""Seconds between two attempts."""
ANSWER_TIMEOUT = 1.0
"""Seconds allowed for connecting to the sender, and for its answer."""
PLAUSIBLE_AGE = 30.0
"""An age beyond this says that two clocks disagree, not that the picture is old [s]."""


class SenderUnreachable(RuntimeError):
    """The sender cannot be had; the text says why."""


class WebrtcCamera:
    """Receives on a thread of its own while `wanted`.

    Args:
        address: Host, host:port or http://host:port of the sender.
        with_time: Ask for pictures that carry the time they were taken, and measure their age.
    Attributes:
        image: (height, width, 3) uint8, BGR. Stamped with the time taken where the picture carries it, else with the
            time of arrival.
        problem: Why there is no picture; empty while there is one.
        age: Of the newest picture at its arrival [s]; None where it carries no time.
        received, connections: Counts; of pictures, those that are new.
    Raises:
        ValueError: The address is invalid.
    """

    def __init__(self, address: str, with_time: bool = False) -> None:
        self.url = sender_url(address)
        self._signaling = SignalingClient(self.url, "camera sender", ANSWER_TIMEOUT)
        self.image = LatestImage()
        self.problem = "not connected yet"
        self.age: float | None = None
        self.received = 0
        self.connections = 0
        self._with_time = with_time
        self._moves = False
        self._wanted = False
        self._leaving: set[asyncio.Task] = set()
        self._changed = asyncio.Event()
        self._loop = asyncio.new_event_loop()
        self._work: asyncio.Task | None = None
        self._thread = threading.Thread(target=self._run, name="webrtc", daemon=True)
        self._thread.start()

    def want(self, wanted: bool) -> None:
        """Connect, or leave."""
        if wanted != self._wanted:
            self._wanted = wanted
            self._loop.call_soon_threadsafe(self._changed.set)

    def close(self) -> None:
        """Leave; at most about two seconds."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(lambda: self._work.cancel() if self._work else None)
            self._thread.join(timeout=3.0)

    # --- the loop's thread -------------------------------------------------------------------------------------------

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._work = self._loop.create_task(self._keep_connected())
        try:
            with contextlib.suppress(asyncio.CancelledError):
                self._loop.run_until_complete(self._work)
            if self._leaving:
                self._loop.run_until_complete(asyncio.wait(self._leaving, timeout=ANSWER_TIMEOUT))
        finally:
            self._loop.run_until_complete(self._loop.shutdown_default_executor())
            self._loop.close()

    async def _keep_connected(self) -> None:
        async with self._signaling.session() as session:
            try:
                while True:
                    self._changed.clear()
                    if not self._wanted:
                        await self._changed.wait()
                        continue
                    try:
                        await self._receive(session)
                    except SenderUnreachable as error:
                        self._say(str(error))
                        await asyncio.sleep(RETRY_PERIOD)
            finally:
                if self._leaving:
                    await asyncio.wait(self._leaving, timeout=ANSWER_TIMEOUT)

    async def _receive(self, session: aiohttp.ClientSession) -> None:
        """One connection, until it is lost or not wanted any more."""
        peer = peer_connection()
        location = None
        self._moves = False
        try:
            location = await self._connect(session, peer)
            track = peer.getTransceivers()[0].receiver.track
            draining = asyncio.ensure_future(drain(track, self._take))
            try:
                await self._supervise(draining)
            finally:
                draining.cancel()
        finally:
            task = asyncio.ensure_future(self._leave(session, peer, location))
            self._leaving.add(task)
            task.add_done_callback(self._leaving.discard)

    async def _connect(self, session: aiohttp.ClientSession, peer: RTCPeerConnection) -> str | None:
        """Exchange offer and answer; our place at the sender."""
        try:
            peer.addTransceiver("video", direction="recvonly")
            query = {"time": "1"} if self._with_time else None
            location = await self._signaling.exchange(session, peer, query)
        except Refused as error:
            raise SenderUnreachable(str(error)) from None
        except (aiohttp.ClientError, TimeoutError, OSError) as error:
            raise SenderUnreachable(f"the camera sender at {self.url} does not answer: {_cause(error)}") from error
        self.connections += 1
        return location

    async def _supervise(self, draining: asyncio.Future) -> None:
        """Wait until the pictures stop coming, which raises SenderUnreachable, or are not wanted any more."""
        begin, before = time.monotonic(), self.received
        while self._wanted:
            await asyncio.sleep(0.1)
            patience = LOST_AFTER if self.received > before else FIRST_PICTURE
            silence = min(time.monotonic() - begin, self.image.age())
            if draining.done():
                raise SenderUnreachable(f"the camera sender at {self.url} has ended")
            if silence > patience:
                raise SenderUnreachable(f"no picture from {self.url} for {silence:.1f} s")

    async def _leave(self, session: aiohttp.ClientSession, peer: RTCPeerConnection, location: str | None) -> None:
        await peer.close()
        await self._signaling.leave(session, location)

    def _take(self, frame: av.VideoFrame) -> None:
        if not self._moves:
            self._moves = True
            return
        pixels = frame.to_ndarray(format="bgr24")
        now = time.time()
        age = read_age(pixels, now) if self._with_time else None
        self.age = age if age is not None and abs(age) < PLAUSIBLE_AGE else None
        self.received += 1
        if self.problem:
            log.info("pictures come from %s", self.url)
            self.problem = ""
        self.image.put(pixels, now - self.age if self.age is not None else now)

    def _say(self, problem: str) -> None:
        if problem != self.problem:
            log.info("%s", problem)  # whoever looks says so, when it has lasted
        self.problem = problem


async def receive_by_copy_and_paste(
    signaling: CopyPasteSignaling, take: Callable[[av.VideoFrame], None], address: str | None = None
) -> None:
    """Read an offer, give the answer, hand over pictures until the sender ends or says goodbye. A new offer that is
    pasted meanwhile takes the old one's place.

    Args:
        take: Must be quick.
        address: Of this machine, for the sender to find us at; None for all but loopback.
    Raises:
        ValueError: There is nobody to paste an offer.
    """
    await signaling.connect()
    offers: list[RTCSessionDescription] = []
    try:
        signaling.ask("the line that the sender printed")
        while True:
            peer = peer_connection()
            try:
                if not await take_description(signaling, peer, "offer", offers):
                    signaling.say(EXITING)
                    return
                videos = [each.receiver.track for each in peer.getTransceivers() if each.kind == "video"]
                if not videos:
                    signaling.explain("this offer sends no video")
                    continue
                for each in peer.getTransceivers():  # nothing else is taken in: nobody would look at it
                    each.direction = "recvonly" if each.receiver.track is videos[0] else "inactive"
                with on_address(address):
                    await peer.setLocalDescription(await peer.createAnswer())
                await signaling.send(peer.localDescription)
                message = await _receive_from_one(signaling, peer, videos[0], take)
            finally:
                await asyncio.shield(peer.close())  # aiortc may be closing it too, and fails when this is cancelled
            if not isinstance(message, RTCSessionDescription):
                signaling.say(EXITING if message is BYE else "The sender has ended or cannot be reached any more.")
                return
            offers.append(message)
    finally:
        await signaling.close()


async def _receive_from_one(
    signaling: CopyPasteSignaling,
    peer: RTCPeerConnection,
    track: MediaStreamTrack,
    take: Callable[[av.VideoFrame], None],
) -> Message | None:
    """Hand over pictures; what was pasted to end that, None when the pictures themselves have ended."""
    reading = asyncio.ensure_future(follow(signaling, peer, "offer"))
    draining = asyncio.ensure_future(drain(track, take))
    connecting = asyncio.ensure_future(connected(signaling, peer))
    try:
        await asyncio.wait({reading, draining}, return_when=asyncio.FIRST_COMPLETED)
        return reading.result() if reading.done() else None
    finally:
        for task in (reading, draining, connecting):
            task.cancel()


def sender_url(address: str) -> str:
    """Where offers go.

    Raises:
        ValueError: The address is invalid.
    """
    text = address.strip()
    parts = urlsplit(text if "://" in text else f"http://{text}")
    try:
        port = parts.port or ports.ROBOTINO_CAMERA
    except ValueError:
        port = None
    if parts.scheme != "http" or not parts.hostname or parts.path not in ("", "/") or port is None:
        raise ValueError(f"not the address of a camera sender: {address!r}; expected host, host:port, http://host:port")
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    return f"http://{host}:{port}/camera"


def _cause(error: Exception) -> str:
    if isinstance(error, TimeoutError):
        return f"nothing within {ANSWER_TIMEOUT:g} s"
    error = error.os_error if isinstance(error, aiohttp.ClientConnectorError) else error
    if isinstance(error, OSError) and error.errno and error.errno > 0:  # those of the name service are negative
        return os.strerror(error.errno).lower()
    return str(error) or type(error).__name__
