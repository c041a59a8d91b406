"""RobotSound: the pilot's end of a conversation with a robot's sound server, made anew as often as needed. No ROS.

POST http://HOST:PORT/sound     audio both ways, see `rto_node.signaling_client`
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
import time
from collections.abc import Callable
from urllib.parse import urlsplit

import aiohttp

from rto_node.signaling_client import Refused, SignalingClient
from telepresence import ports
from telepresence.audio.webrtc_sound import MicrophoneTrack, listen
from telepresence.start_patience import StartPatience
from telepresence.video.webrtc import peer_connection, release_early

log = logging.getLogger(__name__)

LOST_AFTER = 3.0
"""Seconds without a frame after which the connection is made anew; a robot without a microphone sends one a second."""
FIRST_FRAME = 5.0
"""Seconds that the first one may take: a robot with an earlier version and without a microphone needs four."""
RETRY_PERIOD = 1.0
ANSWER_TIMEOUT = 2.0


class RobotSound:
    """Talks and listens on a thread of its own, from `start` to `close`.

    Args:
        address: host or host:port of the sound server.
        on_sound: Receives the sound of the robot's microphone: int16 stereo interleaved, 48 kHz.
    Attributes:
        problem: Why there is no conversation; "" while there is one.
    """

    def __init__(self, address: str, on_sound: Callable[[bytes], None]) -> None:
        host = address if "://" in address else f"http://{address}"
        parts = urlsplit(host)
        if parts.scheme != "http" or not parts.hostname or parts.path not in ("", "/"):
            raise ValueError(f"not the address of a sound server: {address!r}; expected host or host:port")
        named = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
        self.url = f"http://{named}:{parts.port or ports.ROBOTINO_SOUND}/sound"
        self._signaling = SignalingClient(self.url, "sound server", ANSWER_TIMEOUT)
        self.problem = "not connected yet"
        self._warned, self._patience = "", StartPatience()
        self.frames = self.connections = 0
        self._on_sound = on_sound
        self._track: MicrophoneTrack | None = None
        self._last = 0.0
        self._loop = asyncio.new_event_loop()
        self._work: asyncio.Task | None = None
        self._thread = threading.Thread(target=self._run, name="robot-sound", daemon=True)

    def start(self) -> RobotSound:
        self._thread.start()
        return self

    def close(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(lambda: self._work.cancel() if self._work else None)
            self._thread.join(timeout=4.0)

    def put(self, frames: bytes) -> None:
        """The pilot's voice: int16 stereo interleaved, 48 kHz; from one thread."""
        track = self._track
        if track is not None:
            track.put(frames)

    # --- the loop's thread -------------------------------------------------------------------------------------------

    def _run(self) -> None:
        release_early()
        asyncio.set_event_loop(self._loop)
        self._work = self._loop.create_task(self._keep_connected())
        try:
            with contextlib.suppress(asyncio.CancelledError):
                self._loop.run_until_complete(self._work)
        finally:
            self._loop.run_until_complete(self._loop.shutdown_default_executor())
            self._loop.close()

    async def _keep_connected(self) -> None:
        async with self._signaling.session() as session:
            while True:
                try:
                    await self._converse(session)
                except (OSError, TimeoutError, aiohttp.ClientError, ValueError, Refused) as error:
                    self._say(str(error) or f"no answer from {self.url}")
                await asyncio.sleep(RETRY_PERIOD)

    async def _converse(self, session: aiohttp.ClientSession) -> None:
        """One connection, until it is lost: raises ValueError with the reason."""
        peer, location, hearing = peer_connection(), None, None
        track = MicrophoneTrack()
        try:
            peer.addTrack(track)
            location = await self._signaling.exchange(session, peer)
            self._track, self._last = track, 0.0
            begin = time.monotonic()
            self.problem = nothing = (
                f"nothing comes from {urlsplit(self.url).hostname}, which has answered: sound is sent by UDP, "
                "which a firewall may keep back"
            )
            self.connections += 1
            hearing = asyncio.ensure_future(listen(peer.getTransceivers()[0].receiver.track, self._take))
            while True:
                await asyncio.sleep(0.2)
                if peer.connectionState in ("closed", "failed") or hearing.done():
                    raise ValueError(f"the conversation with {self.url} has ended" if self._last else nothing)
                if not self._last and time.monotonic() - begin > FIRST_FRAME:
                    raise ValueError(nothing)
                if self._last and time.monotonic() - self._last > LOST_AFTER:
                    raise ValueError(f"nothing heard from {self.url} for {LOST_AFTER:g} s")
        finally:
            self._track = None
            track.stop()
            if hearing is not None:
                hearing.cancel()
            await peer.close()
            await self._signaling.leave(session, location)

    def _take(self, frames: bytes) -> None:
        if not self._last:
            log.info("sound both ways with %s", self.url)
            self.problem = self._warned = ""
        self._last = time.monotonic()
        self.frames += 1
        self._patience.works()
        self._on_sound(frames)

    def _say(self, problem: str) -> None:
        self.problem = problem
        if problem != self._warned and self._patience.over:
            log.warning("%s", problem)
            self._warned = problem
