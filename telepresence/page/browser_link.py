"""The WebRTC connection of one browser: pictures out, commands in. One event loop.

The page makes three channels before its offer: `drive` and `state` lose what is late, `ask` loses nothing. What of them
counts is decided here, at each message, and never by what the page shows.
"""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections.abc import Callable
from typing import Any

from aiortc import RTCConfiguration, RTCDataChannel, RTCPeerConnection, RTCSessionDescription

from telepresence.page.browser_window import BrowserWindow
from telepresence.page.commands import BadMessage, parse_ask, parse_drive
from telepresence.page.shared_video import SharedVideo
from telepresence.video.foreign_sdp import CHANNELS, KINDS, checked
from telepresence.video.webrtc import on_address

log = logging.getLogger(__name__)

STATE_PERIOD = 0.1
"""[s] between two messages about who drives, what the gate does and how old the picture is."""
SILENCE = 3.0
"""[s] without a message of the page after which its connection is given up; it dials again."""
MOST_UNSENT = 16 * 1024
"""Bytes that may wait for a browser: a state is left out rather than sent late."""


class BrowserLink:
    """Answers one offer, and lives until the browser hangs up or falls silent.

    Args:
        window: The browser's way to drive, which outlives its connections.
        video: What it looks at.
        state: What to tell the page besides, as JSON's types.
        ended: Called when the connection is over.
    """

    def __init__(
        self,
        window: BrowserWindow,
        video: SharedVideo,
        state: Callable[[], dict[str, Any]],
        ended: Callable[[BrowserLink], None],
    ) -> None:
        self._window, self._video, self._state, self._ended = window, video, state, ended
        self._peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self._peer.on("datachannel", self._on_channel)
        self._peer.on("connectionstatechange", self._on_connection)
        self._channels: dict[str, RTCDataChannel] = {}
        self._heard = time.monotonic()
        self._task: asyncio.Task | None = None
        self._sender: Any = None
        self._over = False
        self.bad = 0
        """Messages that no page of ours sends."""

    async def answer(self, offer: str, address: str | None) -> str:
        """Return the answer to a browser's offer (SDP).

        Args:
            address: Of this machine, where the browser is to find us; None for all.
        Raises:
            ValueError: It is no offer of a page of ours.
        """
        offer = checked(offer, kinds={*KINDS, CHANNELS})
        try:
            with on_address(address):
                await self._peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
                if not any(each.kind == "video" for each in self._peer.getTransceivers()):
                    raise ValueError("the offer asks for no picture")
                track = self._video.track()
                self._sender = self._peer.addTrack(track)
                self._sender._send_keyframe = self._video.ask_for_key_picture  # what its packer would ignore
                await self._peer.setLocalDescription(await self._peer.createAnswer())
        except BaseException as error:  # cancellation, too, must leave nothing behind
            await self.close()
            if isinstance(error, Exception) and not isinstance(error, ValueError):
                # aiortc parses with asserts and indices; whatever it stumbles over is the offer's fault.
                raise ValueError(f"the offer cannot be understood: {error!r}") from error
            raise
        self._task = asyncio.ensure_future(self._live())
        return self._peer.localDescription.sdp

    async def close(self) -> None:
        """Hang up."""
        if self._over:
            return
        self._over = True
        self._window.let_go(time.monotonic())
        if self._task is not None and self._task is not asyncio.current_task():
            self._task.cancel()
        if self._sender is not None and self._sender.track is not None:
            self._sender.track.stop()
        await self._peer.close()
        self._ended(self)

    async def _live(self) -> None:
        try:
            while time.monotonic() - self._heard < SILENCE:
                await asyncio.sleep(STATE_PERIOD)
                self._report()
        finally:
            if not self._over:
                await self.close()

    def _report(self) -> None:
        channel = self._channels.get("state")
        if channel is None or channel.readyState != "open" or channel.bufferedAmount > MOST_UNSENT:
            return
        channel.send(json.dumps(self._state() | {"picture": self._newest_picture()}, separators=(",", ":")))

    def _newest_picture(self) -> list[float] | None:
        """RTP time of the newest picture that was sent, as the page sees it, and how old it was by now [s]."""
        track = self._sender.track
        newest = self._sender._RTCRtpSender__rtp_timestamp  # no public name
        if track is None or track.sent is None:
            return None
        return [newest, time.time() - track.sent[1]]

    def _on_channel(self, channel: RTCDataChannel) -> None:
        takes = {"drive": self._on_drive, "ask": self._on_ask, "state": lambda _message: None}
        if channel.label not in takes or channel.label in self._channels:
            channel.close()
            return
        self._channels[channel.label] = channel
        channel.on("message", takes[channel.label])

    def _on_drive(self, text: str | bytes) -> None:
        now = time.monotonic()
        try:
            message = parse_drive(text)
        except BadMessage as error:
            self._note_bad(error)
            return
        self._heard = now
        if self._window.drive(message, now) and self._channels["drive"].readyState == "open":
            self._channels["drive"].send(json.dumps({"n": message.number}))

    def _on_ask(self, text: str | bytes) -> None:
        try:
            message = parse_ask(text)
        except BadMessage as error:
            self._note_bad(error)
            return
        self._window.ask(message)

    def _note_bad(self, error: BadMessage) -> None:
        self.bad += 1
        if self.bad == 1:
            log.warning("a browser sends what no page of ours does: %s", error)

    async def _on_connection(self) -> None:
        if self._peer.connectionState in ("failed", "closed"):
            await self.close()
