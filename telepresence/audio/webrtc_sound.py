"""Sound both ways over one WebRTC connection: a microphone as a track, a track into a loudspeaker.

Opus by aiortc, 48 kHz, frames of 20 ms. Four frames are held back to put them in order, which is most of the delay; one
that is lost becomes silence of its length (see `telepresence.video.webrtc.release_early`).
"""

from __future__ import annotations

import asyncio
import contextlib
import fractions
from collections import deque
from collections.abc import Callable

import av
from aiortc import MediaStreamTrack
from aiortc.mediastreams import MediaStreamError

RATE = 48000
SAMPLES = 960
"""Samples per frame: 20 ms."""
_BYTES, _DURATION = SAMPLES * 4, SAMPLES / RATE
_WAITING = 10
"""Frames that may wait for the network; older ones are dropped, so that sound is lost rather than late."""
_MAX_HOLE = RATE // 2
"""Samples; a longer one is a pause."""
_SILENCE = bytes(_BYTES)


LIFE_PERIOD = 1.0
"""Seconds after which a track that is given nothing sends a frame of silence: the other end takes a connection on which
nothing comes for lost, and a pilot without a microphone may listen."""
FIRST_FRAMES = 8
"""Frames that such a track sends one after the other at the beginning: the other end holds back four, and would hear
the first of them four seconds later."""


class MicrophoneTrack(MediaStreamTrack):
    """Sends what `put` is given, and now and then silence while there is nothing, which keeps the connection alive."""

    kind = "audio"

    def __init__(self) -> None:
        super().__init__()
        self._event_loop = asyncio.get_running_loop()
        self._news = asyncio.Event()
        self._rest = b""
        self._frames: deque[tuple[int, bytes]] = deque(maxlen=_WAITING)
        self._count = 0

    def put(self, frames: bytes) -> None:
        """Int16 little-endian, stereo interleaved, 48 kHz; from any one thread."""
        with contextlib.suppress(RuntimeError):  # the loop may have ended since
            self._event_loop.call_soon_threadsafe(self._append, frames)

    def _append(self, data: bytes) -> None:
        self._rest += data
        while len(self._rest) >= _BYTES:
            frame, self._rest = self._rest[:_BYTES], self._rest[_BYTES:]
            self._frames.append((self._count, frame))
            self._count += 1
        self._news.set()

    async def recv(self) -> av.AudioFrame:
        while not self._frames:
            if self.readyState != "live":
                raise MediaStreamError
            self._news.clear()
            try:
                await asyncio.wait_for(self._news.wait(), LIFE_PERIOD if self._count >= FIRST_FRAMES else _DURATION)
            except TimeoutError:
                self._append(_SILENCE)
        number, data = self._frames.popleft()
        frame = av.AudioFrame(format="s16", layout="stereo", samples=SAMPLES)
        frame.planes[0].update(data)
        frame.pts = number * SAMPLES
        frame.sample_rate = RATE
        frame.time_base = fractions.Fraction(1, RATE)
        return frame

    def stop(self) -> None:
        super().stop()
        self._news.set()


async def listen(track: MediaStreamTrack, push: Callable[[bytes], None]) -> None:
    """Pass on every frame, int16 stereo interleaved at 48 kHz, until the track ends; silence in place of lost ones.
    `push` must be quick."""
    expected: int | None = None
    while True:
        try:
            frame = await track.recv()
        except MediaStreamError:
            return
        if not isinstance(frame, av.AudioFrame) or frame.pts is None:
            continue  # aiortc's decoders deliver neither
        missing = frame.pts - expected if expected is not None else 0
        if 0 < missing <= _MAX_HOLE:
            push(bytes(4 * missing))
        expected = frame.pts + frame.samples
        push(bytes(frame.planes[0])[: frame.samples * 4])
