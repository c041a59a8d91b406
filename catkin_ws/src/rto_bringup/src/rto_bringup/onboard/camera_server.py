"""The camera sender: the robot's pictures by WebRTC, video VP8, to a few receivers. Signaling is automatic:

    POST /camera[?time=1]   body: an offer, application/sdp    201, body: the answer, Location: /camera/NAME
    DELETE /camera/NAME     200: the receiver has left
    GET /camera             200, JSON: {"receivers": n, "problem": why there is no picture, or ""}

Who may ask, and how it is proven: `signaling_server`. Without a key that is WHEP (draft-ietf-wish-whep). With time=1
the time at which a picture was taken is drawn into it. A NAME is random, so nobody ends another one's pictures.
Candidates are offered on the one address that the offer came to, and used on the one that it came from; nobody's server
is asked for ours.

By copy and paste, as the Robotino guide has it, this side prints the offer as one line and reads the answer, see
`telepresence.video.copy_paste_signaling`.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import datetime
import logging
import secrets
from collections.abc import Callable

from aiohttp import web
from aiortc import RTCPeerConnection, RTCSessionDescription
from aiortc.contrib.signaling import BYE

from rto_bringup.onboard.picture_sources import PictureSource
from rto_bringup.onboard.signaling_server import SDP, SignalingServer, local_address, remote_address
from telepresence.security.robot_key import RobotKey
from telepresence.video.copy_paste_signaling import EXITING, CopyPasteSignaling, connected, follow, take_description
from telepresence.video.foreign_sdp import checked
from telepresence.video.webrtc import NewestPictureTrack, on_address, peer_connection

log = logging.getLogger(__name__)

MAX_RECEIVERS = 3
"""Each costs an encoder of its own: a fifth of a core at 640x480, 30 pictures/s."""
SILENT_RECEIVER = 6.0
"""Seconds without a report (RTCP, about one a second) after which a receiver counts as gone; aiortc takes 28 s."""


class NoPlace(RuntimeError):
    """Nobody else can be served now; the text says why."""


class CameraServer:
    """One camera, several receivers. All of it belongs to one event loop.

    Args:
        source: Closed by its owner.
        key: Without one only this machine's own user is served.
    """

    def __init__(self, source: PictureSource, key: RobotKey | None = None) -> None:
        self._source = source
        self.signaling = SignalingServer(key)
        self._receivers: dict[str, tuple[RTCPeerConnection, asyncio.Task | None]] = {}
        """Receiver's name -> its connection, and the task that ends it when the receiver is silent."""

    def application(self) -> web.Application:
        """Return the application for aiohttp to serve; it ends all connections when it is shut down."""
        application = self.signaling.application(
            web.post("/camera", self._offer),
            web.delete(r"/camera/{name:[0-9a-z]{1,32}}", self._delete),
            web.get("/camera", self._report),
        )
        application.on_shutdown.append(lambda _: self.close())
        return application

    async def close(self) -> None:
        """End every connection; receivers learn it at once."""
        await asyncio.gather(*(self._end(name, "the sender ends") for name in list(self._receivers)))

    async def answer(
        self, offer: str, address: str | None, with_time: bool = False, receiver: str | None = None
    ) -> tuple[str, str]:
        """Begin to send; the receiver's name and the answer's SDP. The place is taken before anything is awaited.

        Args:
            offer: SDP of a receiver.
            address: Of this machine, where the receiver is to find us; None for all.
            with_time: Draw the time into the pictures.
            receiver: Its address, the only one to which anything is sent; None for all that the offer names.
        Raises:
            ValueError: It is not an offer to receive video.
            NoPlace: There are as many receivers as there may be, or all of them were ended meanwhile.
        """
        offer = checked(offer, *([receiver] if receiver else []))
        if len(self._receivers) >= MAX_RECEIVERS:
            raise NoPlace(f"{MAX_RECEIVERS} receivers are connected, which is the limit")
        peer = peer_connection()
        name = self._add(peer)
        self._receivers[name] = peer, asyncio.ensure_future(self._supervise(name, peer))
        try:
            with on_address(address):
                await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
                videos = [each for each in peer.getTransceivers() if each.kind == "video"]
                if not videos:
                    raise ValueError("the offer asks for no video")
                track = NewestPictureTrack(self._source.image, with_time)
                try:
                    peer.addTrack(track)
                except BaseException:  # the receiver has gone meanwhile
                    track.stop()
                    raise
                for each in peer.getTransceivers():  # nothing is taken in: nobody would look at it
                    each.direction = "sendonly" if each.sender.track is not None else "inactive"
                await peer.setLocalDescription(await peer.createAnswer())
            if name not in self._receivers:
                raise NoPlace("the receiver was ended while it was answered")
        except BaseException as error:  # cancellation, too, must not leave a receiver behind
            await self._end(name, "the offer is refused")
            if isinstance(error, Exception) and not isinstance(error, ValueError | NoPlace):
                # aiortc parses with asserts and indices; whatever it stumbles over is the offer's fault.
                raise ValueError(f"the offer cannot be understood: {error!r}") from error
            raise
        return name, peer.localDescription.sdp

    async def send_by_copy_and_paste(
        self, signaling: CopyPasteSignaling, address: str | None, with_time: bool = False
    ) -> None:
        """Offer, read the answer, and send until the receiver says goodbye; a receiver that is lost gets a new offer.

        Arguments as for `answer`.

        Raises:
            ValueError: There is nobody to paste an answer.
        """
        await signaling.connect()
        try:
            while await self._send_to_one(signaling, address, with_time):
                signaling.say("Here is a new offer.")
            signaling.say(EXITING)
        finally:
            await signaling.close()

    async def _send_to_one(self, signaling: CopyPasteSignaling, address: str | None, with_time: bool) -> bool:
        """Make one exchange; False when the receiver said goodbye, True when it is gone without."""
        peer = peer_connection()
        name = self._add(peer)
        peer.addTrack(NewestPictureTrack(self._source.image, with_time))
        try:
            with on_address(address):
                await peer.setLocalDescription(await peer.createOffer())
            await signaling.send(peer.localDescription)
            signaling.ask("the line that the receiver prints")
            if not await take_description(signaling, peer, "answer"):
                return False
            reading = asyncio.ensure_future(follow(signaling, peer, "answer"))
            sending = asyncio.ensure_future(self._send_until_lost(signaling, name, peer))
            try:
                await asyncio.wait({reading, sending}, return_when=asyncio.FIRST_COMPLETED)
                return not (reading.done() and reading.result() is BYE)
            finally:
                reading.cancel()
                sending.cancel()
        finally:
            await self._end(name, "the exchange is over")

    async def _send_until_lost(self, signaling: CopyPasteSignaling, name: str, peer: RTCPeerConnection) -> None:
        """Only a receiver that was there can be lost: until it connects, a person may be looking for the line."""
        if await connected(signaling, peer):
            await self._supervise(name, peer)
            signaling.say("The receiver is gone.")
        else:
            signaling.say("The connection failed.")

    # --- HTTP --------------------------------------------------------------------------------------------------------

    async def _offer(self, request: web.Request) -> web.Response:
        if request.content_type != SDP:
            raise web.HTTPUnsupportedMediaType(text=f"an offer is sent as {SDP}, not as {request.content_type}\n")
        try:
            offer = (await request.read()).decode()
            name, answer = await self.answer(
                offer, local_address(request), request.query.get("time") == "1", remote_address(request)
            )
        except NoPlace as error:
            raise web.HTTPServiceUnavailable(text=f"{error}\n") from None
        except ValueError as error:
            raise web.HTTPBadRequest(text=f"{error}\n") from None
        return web.Response(status=201, body=answer.encode(), content_type=SDP, headers={"Location": f"/camera/{name}"})

    async def _delete(self, request: web.Request) -> web.Response:
        name = request.match_info["name"]
        if name not in self._receivers:
            raise web.HTTPNotFound(text="there is no such receiver\n")
        await self._end(name, "it has left")
        return web.Response()

    async def _report(self, _request: web.Request) -> web.Response:
        return web.json_response({"receivers": len(self._receivers), "problem": self._source.problem})

    # --- receivers ---------------------------------------------------------------------------------------------------

    def _add(self, peer: RTCPeerConnection) -> str:
        name = secrets.token_hex(16)
        self._source.watch()
        self._receivers[name] = peer, None
        return name

    async def _supervise(self, name: str, peer: RTCPeerConnection) -> None:
        """End a receiver that sends no more reports, long before aiortc notices."""
        loop = asyncio.get_running_loop()
        received_at, last = loop.time(), None
        while peer.connectionState not in ("closed", "failed") and loop.time() - received_at < SILENT_RECEIVER:
            await asyncio.sleep(1.0)
            newest = await _newest_report(peer)
            if newest != last:
                received_at, last = loop.time(), newest
        await self._end(name, "it is silent")

    async def _end(self, name: str, reason: str) -> None:
        if name not in self._receivers:
            return
        peer, supervisor = self._receivers.pop(name)
        if supervisor is not None and supervisor is not asyncio.current_task():
            supervisor.cancel()
        self._source.leave()
        for sender in peer.getSenders():
            if sender.track is not None:
                sender.track.stop()
        await asyncio.shield(peer.close())  # aiortc may be closing it too, and fails when this is cancelled
        _give_back_memory()
        log.info("a receiver ended: %s", reason)


def _give_back_memory() -> None:
    """Return to Linux what malloc keeps of ended encoders; later ones do not fit into it: 0.3 MB for each receiver."""
    with contextlib.suppress(AttributeError):  # a C library without it
        ctypes.CDLL(None).malloc_trim(0)


async def _newest_report(peer: RTCPeerConnection) -> datetime.datetime | None:
    """Return when the receiver last reported."""
    report = await peer.getStats()
    return max((each.timestamp for each in report.values() if each.type == "remote-inbound-rtp"), default=None)


async def serve(server: CameraServer, address: str, port: int, ready: Callable[[str], None]) -> None:
    """Answer offers until cancelled; arguments and errors are those of `SignalingServer.serve`."""
    await server.signaling.serve(server.application(), address, port, ready)
