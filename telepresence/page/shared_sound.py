"""One Opus encoder for all who listen to one robot: a further listener costs packets and nothing else.

The robot's sound comes in blocks of any length (Pepper's are 85 ms) and leaves in even packets of 20 ms, because a
browser that gets bursts delays all sound by the longest pause between two. Encoded pieces go to every listener as
`av.Packet`, as pictures do in `shared_video`.
"""

from __future__ import annotations

import asyncio
import contextlib
import fractions
import threading
import time
from collections import deque
from collections.abc import Callable

import av
import numpy as np
from aiortc import MediaStreamTrack
from aiortc.mediastreams import MediaStreamError

from telepresence.audio.schedule import Schedule
from telepresence.audio.webrtc_sound import RATE, SAMPLES

TIME_BASE = fractions.Fraction(1, RATE)
BIT_RATE = 40_000
"""[bits/s]: speech of full band, mono (RFC 7587, 3.1.1)."""
LEAD = 0.015
"""Seconds that a block waits before its first packet leaves: what the next block may be late without a gap."""
MOST = 0.1
"""Seconds that a block waits at most; one that would wait longer came in a burst after a pause, and is left out."""
MOST_WAITING = 10
"""Packets that wait for a listener's network; older ones are left out: lost rather than late."""
LONGEST = 0.5
"""Seconds of one block."""
RATES = (8000, 48000)
"""Lowest and highest sampling rate of the robot's microphone [Hz]."""
_BYTES = 2 * SAMPLES

Take = Callable[[bytes, int, int], None]
"""Gets a block of sound: int16 little-endian, channels interleaved; samples per second, channels. From one thread."""


class SharedSound:
    """Encodes a robot's sound while somebody listens. All of it but `put` belongs to one event loop.

    Args:
        listen: Told where the robot's sound is to go; None while nobody listens.
    """

    def __init__(self, listen: Callable[[Take | None], None]) -> None:
        self._listen = listen
        self._loop: asyncio.AbstractEventLoop | None = None
        self._listeners: set[ListenerTrack] = set()
        self._task: asyncio.Task | None = None
        self._lock = threading.Lock()
        self._resampler: tuple[int, int, av.AudioResampler] | None = None
        self._rest = b""
        self._schedule = Schedule(LEAD, MOST)
        self._waiting: deque[tuple[float, bool, bytes]] = deque()
        self._news = asyncio.Event()

    @property
    def listeners(self) -> int:
        """How many listen now."""
        return len(self._listeners)

    def track(self) -> ListenerTrack:
        """Return a track for one more browser, which listens when it is told to."""
        return ListenerTrack(self)

    def change(self, track: ListenerTrack, listens: bool) -> None:
        """Send to this track, or do not; without any listener the robot's microphone is left alone."""
        (self._listeners.add if listens else self._listeners.discard)(track)
        if self._listeners and self._task is None:
            self._loop = asyncio.get_running_loop()
            self._schedule.forget()
            self._waiting.clear()
            self._task = asyncio.ensure_future(self._encode())
            self._listen(self.put)
        elif not self._listeners and self._task is not None:
            self._task.cancel()
            self._task = None
            self._listen(None)

    def put(self, frames: bytes, rate: int, channels: int) -> None:
        """Take a block of the robot's sound, see `Take`. What is no such block is left out."""
        size = 2 * channels
        if not RATES[0] <= rate <= RATES[1] or not 0 < channels <= 8 or not frames or len(frames) % size:
            return
        if len(frames) > size * rate * LONGEST or self._loop is None:
            return
        arrival = time.monotonic()
        samples: np.ndarray = np.frombuffer(frames, "<i2").reshape(-1, channels)
        mono = samples if channels == 1 else np.mean(samples, axis=1).astype("<i2")
        with self._lock:
            sound = self._resampled(np.ascontiguousarray(mono).reshape(1, -1), rate)
            due, seam = self._schedule.place(arrival, len(samples) / rate)
            if due is None:
                return
            if seam:
                self._rest = b""
            begin = due - len(self._rest) / (2 * RATE)
            sound = self._rest + sound
            whole = len(sound) // _BYTES
            self._rest = sound[whole * _BYTES :]
        pieces = [
            (begin + n * SAMPLES / RATE, seam and n == 0, sound[n * _BYTES : (n + 1) * _BYTES]) for n in range(whole)
        ]
        with contextlib.suppress(RuntimeError):  # the loop may have ended since
            self._loop.call_soon_threadsafe(self._append, pieces)

    def _resampled(self, mono: np.ndarray, rate: int) -> bytes:
        if self._resampler is None or self._resampler[0] != rate:
            self._resampler = rate, 1, av.AudioResampler(format="s16", layout="mono", rate=RATE)
        frame = av.AudioFrame.from_ndarray(mono, format="s16", layout="mono")
        frame.sample_rate = rate
        return b"".join(bytes(piece.planes[0])[: 2 * piece.samples] for piece in self._resampler[2].resample(frame))

    def _append(self, pieces: list[tuple[float, bool, bytes]]) -> None:
        self._waiting.extend(pieces)
        self._news.set()

    async def _encode(self) -> None:
        encoder = av.AudioCodecContext.create("libopus", "w")
        encoder.bit_rate, encoder.format, encoder.layout = BIT_RATE, "s16", "mono"
        encoder.sample_rate, encoder.time_base, encoder.options = RATE, TIME_BASE, {"application": "voip"}
        origin, count = time.monotonic(), 0
        while True:
            while not self._waiting:
                self._news.clear()
                await self._news.wait()
            due, seam, sound = self._waiting.popleft()
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            if seam:  # a pause is one in the browser, too
                count = max(count, round((due - origin) * RATE))
            frame = av.AudioFrame(format="s16", layout="mono", samples=SAMPLES)
            frame.planes[0].update(sound)
            frame.sample_rate, frame.time_base, frame.pts = RATE, TIME_BASE, count
            for packet in encoder.encode(frame):
                packet.pts, packet.time_base = count, TIME_BASE
                for listener in tuple(self._listeners):
                    listener.put(packet)
            count += SAMPLES


class ListenerTrack(MediaStreamTrack):
    """What one browser gets of the robot's sound while it `listens`."""

    kind = "audio"

    def __init__(self, sound: SharedSound) -> None:
        super().__init__()
        self._sound = sound
        self._packets: deque[av.Packet] = deque(maxlen=MOST_WAITING)
        self._news = asyncio.Event()
        self._listens = False

    @property
    def listens(self) -> bool:
        """Whether the browser wants the sound."""
        return self._listens

    @listens.setter
    def listens(self, listens: bool) -> None:
        self._listens = listens and self.readyState == "live"
        self._sound.change(self, self._listens)

    def put(self, packet: av.Packet) -> None:
        """Queue an encoded piece."""
        self._packets.append(packet)
        self._news.set()

    async def recv(self) -> av.Packet:
        while not self._packets:
            if self.readyState != "live":
                raise MediaStreamError
            self._news.clear()
            await self._news.wait()
        return self._packets.popleft()

    def stop(self) -> None:
        super().stop()
        self.listens = False
        self._news.set()
