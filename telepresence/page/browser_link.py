"""The WebRTC connection of one browser: pictures out, commands in. One event loop.

The page makes its channels before its offer: `ask` loses nothing, the others lose what is late.
"""

from __future__ import annotations

import asyncio
import ipaddress
import math
import re
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from aiortc import RTCConfiguration, RTCDataChannel, RTCPeerConnection, RTCSessionDescription

from telepresence.page.bounded_channels import bound_channels
from telepresence.page.browser_conversation import ACTIONS, RobotConversation
from telepresence.page.browser_messages import STATE_PERIOD, BrowserMessages, StationEnd
from telepresence.page.pictures import Pictures
from telepresence.page.prompt_video import show_at_once
from telepresence.page.published_ports import host_address, with_host
from telepresence.page.relays import Relays
from telepresence.page.shared_video import ViewerTrack, rtp_time
from telepresence.page.stream_choice import StreamChoice
from telepresence.video.foreign_sdp import CHANNELS, KINDS, checked
from telepresence.video.webrtc import address_towards, on_address

_ADDRESS = ("a=candidate:", "a=end-of-candidates")
_FIREFOX = re.compile(r"^o=mozilla", re.MULTILINE)
SOMEWHERE = "198.51.100.1"
"""An address that no machine has (RFC 5737): the way there is the default one."""
REPORT_PERIOD = 1.0
"""[s] between two reports of a browser about the packets that it gets, or about that."""
MOST_UNSENT = 16 * 1024
"""Bytes that may wait for a browser: a state is left out rather than sent late."""


class BrowserLink:
    """Answers one offer, and lives until the browser hangs up or falls silent.

    Args:
        pictures: What it looks at.
        end: What it leads to.
        ended: Called when the connection is over.
        relays: Servers that say how this machine looks from outside.
        conversation: Sound and tablet of the robot.
    """

    def __init__(
        self,
        pictures: Pictures,
        end: StationEnd,
        ended: Callable[[BrowserLink], None],
        relays: Relays,
        conversation: RobotConversation,
    ) -> None:
        self._pictures, self._request, self._ended = pictures, end.request, ended
        self._choice = StreamChoice()
        self._conversation = conversation.browser(end.window)
        self.messages = BrowserMessages(replace(end, request=self._carry_out), self._send)
        """What the browser says and gets."""
        self._peer = RTCPeerConnection(RTCConfiguration(iceServers=relays.for_station()))
        self._peer.on("datachannel", self._on_channel)
        self._peer.on("connectionstatechange", self._on_connection)
        self._channels: dict[str, RTCDataChannel] = {}
        self._task: asyncio.Task | None = None
        self._sender: Any = None
        self._track: ViewerTrack | None = None
        self._offset: int | None = None
        self._choice_due = -math.inf
        self._over = self._answering = self._released = False

    async def answer(self, offer: str, address: str | None, host: str = "", ports: range = range(0)) -> str:
        """Return the answer to a browser's offer (SDP).

        Args:
            address: Of this machine, where the browser is to find us; None for all.
            host: As which the browser knows this machine, as its Host header says.
            ports: Those of `published_ports`.
        Raises:
            ValueError: It is no offer of a page of ours.
        """
        self._answering = True
        try:
            outside = await host_address(host) if ports else ""
            self._check_wanted()
            offer = with_addresses_everywhere(checked(offer, kinds={*KINDS, CHANNELS}))
            with on_address(meeting_address(offer, address), ports):
                await self._peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
                self._check_wanted()
                if self._peer.sctp is not None:
                    bound_channels(self._peer.sctp, self.messages.give_up)
                if not any(each.kind == "video" for each in self._peer.getTransceivers()):
                    raise ValueError("the offer asks for no picture")
                self._track = self._pictures.video.track()
                self._sender = self._peer.addTrack(self._track)
                self._sender._send_keyframe = self._track.ask_for_key_picture  # what its packer would ignore
                show_at_once(self._sender)
                self._conversation.join(self._peer)
                await self._peer.setLocalDescription(await self._peer.createAnswer())
                self._check_wanted()
                self._conversation.check()
        except BaseException as error:  # cancellation, too, must leave nothing behind
            self._answering = False
            await self.close()
            if isinstance(error, Exception) and not isinstance(error, ValueError):
                # aiortc parses with asserts and indices; whatever it stumbles over is the offer's fault.
                raise ValueError(f"the offer cannot be understood: {error!r}") from error
            raise
        self._answering = False
        self._task = asyncio.ensure_future(self._live())
        return with_host(self._peer.localDescription.sdp, outside, ports)

    def _check_wanted(self) -> None:
        """Begin nothing that nobody would end. Raises ValueError."""
        if self._over:
            raise ValueError("the connection was given up while it was answered")

    async def close(self) -> None:
        """Hang up; while an offer is answered, that is what ends it: what aiortc opens then, it would not close."""
        if not self._over:
            self._over = True
            self.messages.let_go()
        if self._answering or self._released:
            return
        self._released = True
        if self._task is not None and self._task is not asyncio.current_task():
            self._task.cancel()
        self._conversation.close()
        if self._track is not None:
            self._track.stop()
        await self._peer.close()
        self._ended(self)

    async def _live(self) -> None:
        try:
            while not self.messages.silent:
                await asyncio.sleep(STATE_PERIOD)
                self._conversation.check()
                await self._choose_stream()
                self.messages.report(
                    {
                        "picture": self._newest_picture(),
                        "small": self._choice.small,
                        "sound": self._conversation.describe(),
                    }
                )
        finally:
            if not self._over:
                await self.close()

    async def _choose_stream(self) -> None:
        """Give a network that does not carry the pictures the small ones; the page may ask for them, too."""
        now = time.monotonic()
        if self._track is None or now < self._choice_due:
            return
        self._choice_due = now + REPORT_PERIOD
        reports = [one for one in (await self._sender.getStats()).values() if one.type == "remote-inbound-rtp"]
        lost = max((one.fractionLost / 256 for one in reports), default=None)
        round_trip = max((one.roundTripTime for one in reports if one.roundTripTime is not None), default=None)
        wanted = bool(self.messages.settings.get("small_picture"))
        small = self._choice.choose(lost, round_trip, now, wanted)
        self._track.look_at(self._pictures.small if small else self._pictures.video)

    async def _carry_out(self, action: str, value: Any) -> None:
        if action in ACTIONS:
            self._conversation.ask(action, value)
        else:
            await self._request(action, value)

    def _newest_picture(self) -> list[float] | None:
        """RTP's time of the newest picture as the page sees it, how old it was by now [s], and when it was taken.

        From one such pair the page knows when each picture was taken: RTP's times of a source are as far apart as its
        pictures were.
        """
        track = self._track
        if track is None or track.sent is None:
            return None
        if track.waits and self._offset is None:
            # The sender adds a number that it has thrown to all times of a connection.
            newest = self._sender._RTCRtpSender__rtp_timestamp  # no public name
            self._offset = newest - rtp_time(track.sent)
        rtp = -1 if self._offset is None else (rtp_time(track.sent) + self._offset) & 0xFFFFFFFF
        return [rtp, round(time.time() - track.sent, 4), track.sent]

    def _on_channel(self, channel: RTCDataChannel) -> None:
        if channel.label not in self.messages.kinds or channel.label in self._channels:
            channel.close()
            return
        self._channels[channel.label] = channel
        channel.on("message", partial(self.messages.receive, channel.label))

    def _send(self, kind: str, text: str) -> None:
        channel = self._channels.get(kind)
        if channel is not None and channel.readyState == "open" and channel.bufferedAmount <= MOST_UNSENT:
            channel.send(text)

    async def _on_connection(self) -> None:
        if self._peer.connectionState in ("failed", "closed"):
            await self.close()


def meeting_address(offer: str, address: str | None) -> str | None:
    """Return which address of this machine a browser can reach; `address` is the one that it should.

    Firefox has no loopback address among its own unless it was told to, and tries no way from any other one to ours: a
    browser on the station's machine is met at the address by which both would leave that machine.
    """
    if address is None or not ipaddress.ip_address(address).is_loopback or not _FIREFOX.search(offer):
        return address
    try:
        return address_towards(SOMEWHERE)
    except OSError:  # no network: there is but the way without WebRTC
        return address


def with_addresses_everywhere(offer: str) -> str:
    """Return an offer in which each section has the browser's addresses.

    All sections share one connection (`max-bundle`), so the browser names its addresses in the first one only (RFC
    8843, 7.2); aiortc takes them from the last one.
    """
    head, *sections = re.split(r"(?m)^(?=m=)", offer)
    named = [line for line in sections[0].splitlines() if line.startswith(_ADDRESS)] if sections else []
    lines = "".join(f"{line}\r\n" for line in named)
    return head + "".join(part if "\na=candidate:" in part else part + lines for part in sections)
