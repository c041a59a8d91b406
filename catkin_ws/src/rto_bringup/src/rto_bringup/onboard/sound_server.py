"""The robot's end of the conversation: its microphone to the pilot, the pilot's voice to its loudspeaker, by WebRTC.

    POST /sound             body: an offer with audio both ways, application/sdp    201, body: the answer
                            Location: /sound/NUMBER
    DELETE /sound/NUMBER    200: the pilot has left
    GET /sound              200, JSON: {"pilots": 0 or 1, "microphone": problem or "", "loudspeaker": problem or ""}

One pilot at a time; another one is refused while the first is connected. Candidates are offered on the one address that
the offer came to.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections.abc import Callable

from aiohttp import web
from aiortc import RTCPeerConnection, RTCSessionDescription

from rto_bringup.onboard.camera_server import MAX_OFFER, SDP, local_address
from telepresence.audio.loudspeaker import Loudspeaker
from telepresence.audio.microphone import Microphone
from telepresence.audio.webrtc_sound import RATE, MicrophoneTrack, listen
from telepresence.video.webrtc import on_address, peer_connection, release_early

log = logging.getLogger(__name__)

SILENT_PILOT = 4.0
"""Seconds without a packet, which even a muted pilot sends, after which the place is free."""


class SoundServer:
    """One conversation at a time. All of it belongs to one event loop.

    Args:
        microphone, loudspeaker: Devices of the robot, see `telepresence.audio.devices`.
        patience: Seconds of delay accepted on top, for a busy machine or a poor network.
    """

    def __init__(self, microphone: str = "auto", loudspeaker: str = "auto", patience: float = 0.0) -> None:
        release_early()
        self._track: MicrophoneTrack | None = None
        self._microphone = Microphone(microphone, lambda: RATE, self._received)
        self._loudspeaker = Loudspeaker(loudspeaker, patience=patience)
        self._peer: RTCPeerConnection | None = None
        self._number = 0
        self._numbers = itertools.count(1)
        self._last = 0.0
        self._tasks: set[asyncio.Task] = set()

    def application(self) -> web.Application:
        """Return the application for aiohttp to serve; it ends the conversation when it is shut down."""
        application = web.Application(client_max_size=MAX_OFFER)
        application.add_routes(
            [
                web.post("/sound", self._offer),
                web.delete(r"/sound/{number:\d{1,9}}", self._delete),
                web.get("/sound", self._report),
            ]
        )
        application.on_startup.append(self._start)
        application.on_shutdown.append(self._close)
        return application

    async def _start(self, _application: web.Application) -> None:
        self._microphone.start()
        self._loudspeaker.start()

    async def _close(self, _application: web.Application) -> None:
        await self._end(self._number, "the robot's side ends")
        loop = asyncio.get_running_loop()
        await asyncio.gather(*(loop.run_in_executor(None, end.close) for end in (self._microphone, self._loudspeaker)))

    async def _offer(self, request: web.Request) -> web.Response:
        if request.content_type != SDP:
            raise web.HTTPUnsupportedMediaType(text=f"an offer is sent as {SDP}, not as {request.content_type}\n")
        if self._peer is not None:
            raise web.HTTPServiceUnavailable(text="another pilot is talking\n")
        offer = (await request.read()).decode(errors="replace")
        self._peer = peer = peer_connection()
        self._number = number = next(self._numbers)
        self._last = time.monotonic()
        try:
            with on_address(local_address(request)):
                await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
                audio = [each for each in peer.getTransceivers() if each.kind == "audio"]
                if not audio:
                    raise ValueError("the offer holds no sound")
                self._track = MicrophoneTrack()
                peer.addTrack(self._track)
                await peer.setLocalDescription(await peer.createAnswer())
        except Exception as error:
            # aiortc parses with asserts and indices; whatever it stumbles over is the offer's fault.
            await self._end(number, "the offer is refused")
            raise web.HTTPBadRequest(text=f"the offer cannot be understood: {error}\n") from None
        self._keep(listen(audio[0].receiver.track, self._play))
        self._keep(self._supervise(number))
        log.info("a pilot talks")
        answer = peer.localDescription.sdp.encode()
        return web.Response(status=201, body=answer, content_type=SDP, headers={"Location": f"/sound/{number}"})

    async def _delete(self, request: web.Request) -> web.Response:
        if self._peer is None or int(request.match_info["number"]) != self._number:
            raise web.HTTPNotFound(text="there is no such pilot\n")
        await self._end(self._number, "the pilot has left")
        return web.Response()

    async def _report(self, _request: web.Request) -> web.Response:
        return web.json_response(
            {
                "pilots": int(self._peer is not None),
                "microphone": self._microphone.pipeline.problem or "",
                "loudspeaker": self._loudspeaker.pipeline.problem or "",
            }
        )

    async def _supervise(self, number: int) -> None:
        while self._peer is not None and self._number == number:
            if time.monotonic() - self._last > SILENT_PILOT:
                await self._end(number, "the pilot is silent")
                return
            await asyncio.sleep(0.5)

    async def _end(self, number: int, reason: str) -> None:
        if self._peer is None or number != self._number:
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
    runner = web.AppRunner(server.application(), access_log=None, shutdown_timeout=1.0)
    await runner.setup()
    try:
        await web.TCPSite(runner, address, port).start()
        ready("http://{}:{}".format(*runner.addresses[0][:2]))
        await asyncio.Event().wait()
    finally:
        await runner.cleanup()
