"""The robot's end of the conversation: its microphone to the pilot, the pilot's voice to its loudspeaker, by WebRTC.

    POST /sound             body: an offer with audio both ways, application/sdp    201, body: the answer
                            Location: /sound/NAME
    DELETE /sound/NAME      200: the pilot has left
    GET /sound              200, JSON: {"pilots": 0 or 1, "microphone": problem or "", "loudspeaker": problem or ""}

Who may ask, and how it is proven: `signaling_server`. One pilot at a time; another one is refused while the first is
connected. Candidates are offered on the one address that the offer came to, and used on the one that it came from.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import Callable

from aiohttp import web
from aiortc import MediaStreamTrack, RTCPeerConnection, RTCSessionDescription

from rto_bringup.onboard.signaling_server import SDP, SignalingServer, local_address, remote_address
from telepresence.audio.loudspeaker import Loudspeaker
from telepresence.audio.microphone import Microphone
from telepresence.audio.webrtc_sound import RATE, MicrophoneTrack, listen
from telepresence.security.robot_key import RobotKey
from telepresence.video.foreign_sdp import checked
from telepresence.video.webrtc import on_address, peer_connection, release_early

log = logging.getLogger(__name__)

SILENT_PILOT = 4.0
"""Seconds without a packet, which even a muted pilot sends, after which the place is free."""


class SoundServer:
    """One conversation at a time. All of it belongs to one event loop.

    Args:
        microphone, loudspeaker: Devices of the robot, see `telepresence.audio.devices`.
        patience: Seconds of delay accepted on top, for a busy machine or a poor network.
        key: Without one only this machine's own user is served.
    """

    def __init__(
        self,
        microphone: str = "auto",
        loudspeaker: str = "auto",
        patience: float = 0.0,
        key: RobotKey | None = None,
    ) -> None:
        release_early()
        self.signaling = SignalingServer(key)
        self._track: MicrophoneTrack | None = None
        self._microphone = Microphone(microphone, lambda: RATE, self._received)
        self._loudspeaker = Loudspeaker(loudspeaker, patience=patience)
        self._peer: RTCPeerConnection | None = None
        self._name = ""
        self._last = 0.0
        self._tasks: set[asyncio.Task] = set()

    def application(self) -> web.Application:
        """Return the application for aiohttp to serve; it ends the conversation when it is shut down."""
        application = self.signaling.application(
            web.post("/sound", self._offer),
            web.delete(r"/sound/{name:[0-9a-z]{1,32}}", self._delete),
            web.get("/sound", self._report),
        )
        application.on_startup.append(self._start)
        application.on_shutdown.append(self._close)
        return application

    async def _start(self, _application: web.Application) -> None:
        self._microphone.start()
        self._loudspeaker.start()

    async def _close(self, _application: web.Application) -> None:
        await self._end(self._name, "the robot's side ends")
        loop = asyncio.get_running_loop()
        await asyncio.gather(*(loop.run_in_executor(None, end.close) for end in (self._microphone, self._loudspeaker)))

    async def _offer(self, request: web.Request) -> web.Response:
        if request.content_type != SDP:
            raise web.HTTPUnsupportedMediaType(text=f"an offer is sent as {SDP}, not as {request.content_type}\n")
        offer = (await request.read()).decode(errors="replace")
        if self._peer is not None:
            raise web.HTTPServiceUnavailable(text="another pilot is talking\n")
        # From here to the next await the place is taken.
        self._peer = peer = peer_connection()
        self._name = name = secrets.token_hex(16)
        self._last = time.monotonic()
        try:
            voice, track = await self._converse(peer, checked(offer, remote_address(request)), local_address(request))
        except BaseException as error:  # cancellation, too, must not leave a pilot behind
            await self._end(name, "the offer is refused")
            if not isinstance(error, Exception):
                raise
            # aiortc parses with asserts and indices; whatever it stumbles over is the offer's fault.
            raise web.HTTPBadRequest(text=f"the offer cannot be understood: {error}\n") from None
        if self._peer is not peer:
            await peer.close()
            raise web.HTTPServiceUnavailable(text="the conversation was ended while it was answered\n")
        self._track = track
        self._keep(listen(voice, self._play))
        self._keep(self._supervise(name))
        log.info("a pilot talks")
        answer = peer.localDescription.sdp.encode()
        return web.Response(status=201, body=answer, content_type=SDP, headers={"Location": f"/sound/{name}"})

    @staticmethod
    async def _converse(
        peer: RTCPeerConnection, offer: str, address: str | None
    ) -> tuple[MediaStreamTrack, MicrophoneTrack]:
        """Answer an offer; the pilot's voice, and the track for the robot's.

        Raises:
            ValueError: It holds no sound.
        """
        with on_address(address):
            await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
            audio = [each for each in peer.getTransceivers() if each.kind == "audio"]
            if not audio:
                raise ValueError("the offer holds no sound")
            track = MicrophoneTrack()
            peer.addTrack(track)
            for each in peer.getTransceivers():  # nothing else is taken in: nobody would hear or see it
                each.direction = "sendrecv" if each is audio[0] else "inactive"
            await peer.setLocalDescription(await peer.createAnswer())
        return audio[0].receiver.track, track

    async def _delete(self, request: web.Request) -> web.Response:
        if self._peer is None or request.match_info["name"] != self._name:
            raise web.HTTPNotFound(text="there is no such pilot\n")
        await self._end(self._name, "the pilot has left")
        return web.Response()

    async def _report(self, _request: web.Request) -> web.Response:
        return web.json_response(
            {
                "pilots": int(self._peer is not None),
                "microphone": self._microphone.pipeline.problem or "",
                "loudspeaker": self._loudspeaker.pipeline.problem or "",
            }
        )

    async def _supervise(self, name: str) -> None:
        while self._peer is not None and self._name == name:
            if time.monotonic() - self._last > SILENT_PILOT:
                await self._end(name, "the pilot is silent")
                return
            await asyncio.sleep(0.5)

    async def _end(self, name: str, reason: str) -> None:
        if self._peer is None or name != self._name:
            return
        peer, self._peer = self._peer, None
        if self._track is not None:
            self._track.stop()
            self._track = None
        await peer.close()
        log.info("the conversation ended: %s", reason)

    def _received(self, frames: bytes) -> None:  # on a thread of the microphone
        track = self._track
        if track is not None:
            track.put(frames)

    def _play(self, frames: bytes) -> None:
        self._last = time.monotonic()
        self._loudspeaker.push(frames)

    def _keep(self, work) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


async def serve_sound(server: SoundServer, address: str, port: int, ready: Callable[[str], None]) -> None:
    """Answer offers until cancelled. Arguments and errors as for `camera_server.serve`."""
    await server.signaling.serve(server.application(), address, port, ready)
