"""The pilot's voice to the robot's loudspeaker, through NAOqi alone: nothing is installed on the robot.

Wire: ALAudioDevice.sendRemoteBufferToOutput(frames, buffer): int16 little-endian, stereo interleaved, at most 16384
frames. The robot queues buffers, up to more than a second, and does not report how much waits there. So the delay is
decided here: pieces go out as the microphone delivers them, a small cushion ahead, and whatever could have grown the
robot's queue (a link that stood still, a backlog, a clock that drifts) ends with `flushAudioOutputs` and a new cushion.
Silence is not sent, so that the queue runs empty between sentences; what the microphone recorded just before a word is
the cushion. Sources: NAOqi 2.8 documentation, ALAudioDevice; depth of the queue as reported by users of real robots.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np
from naoqi_driver.connection import CallRefused, Connection, PendingCall, RobotError
from naoqi_driver.replies import number

log = logging.getLogger(__name__)

RATES = (16000, 22050, 44100, 48000)
"""What the robot can play [Hz]."""
PIECE = 0.02
"""Seconds of sound per call."""
CUSHION = 3
"""Pieces sent ahead when a word begins: what a late call may be late without a gap."""
BACKLOG = 10
"""Waiting pieces that count as an overflow: they would be played too late."""
STALL = 0.3
"""Seconds without an answer after which the link counts as standing still."""
QUIET = -60.0
"""A piece below this mean level is silence [dBFS]."""
HANGOVER = 0.8
"""Seconds of silence that are still sent after a word."""
DRIFT = 0.06
"""Seconds by which the microphone's clock may run ahead of ours before the robot's queue is emptied."""
RESYNC = 600.0
"""Seconds of sound without a pause after which the robot's clock may have drifted from ours by too much."""
RETRY_PERIOD = 1.0
"""Seconds of silence after the robot refused a call."""
_BYTES_PER_FRAME = 4
_DEVICE = "ALAudioDevice"


class SpeakerStream:
    """Sends what it is given, from `start` to `close`.

    Args:
        rate: What the robot shall play [Hz]; 0 takes what it plays now, which is safest: older robots ignore a change.
        patience: Seconds on top of the cushion, for a busy machine or a poor network.
        clock: Monotonic seconds, by which the robot's queue is judged.
    """

    def __init__(
        self,
        connection: Connection,
        rate: int = 0,
        patience: float = 0.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if rate and rate not in RATES:
            raise ValueError(f"the robot plays {', '.join(map(str, RATES))} Hz, not {rate}")
        self.rate = rate or 22050
        """Samples per second that `put` expects; the robot has the last word."""
        self.on_rate: Callable[[], None] = lambda: None
        """Called when `rate` has changed."""
        self.problem: str | None = None
        """Why the robot plays nothing; None when nothing is wrong."""
        self.pieces = 0
        """Calls so far."""
        self.flushes = 0
        """How often the robot's queue was emptied."""
        self._connection = connection
        self._clock = clock
        self._wanted = rate
        self._rest = b""
        self._queue: deque[bytes] = deque(maxlen=4 * BACKLOG)
        self._arrived = threading.Condition()
        self._pending: deque[tuple[float, PendingCall]] = deque()
        pieces = CUSHION + round(patience / PIECE)
        self._before: deque[bytes] = deque(maxlen=pieces)
        self._cushion = PIECE * pieces
        self._link = -1
        self._stalled = False
        self._talking = False
        self._loud_until = self._pause_until = 0.0
        self._since = self._sent = 0.0
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="speaker-stream", daemon=True)

    def start(self) -> SpeakerStream:
        self._thread.start()
        return self

    def close(self) -> None:
        with self._arrived:
            self._closing = True
            self._arrived.notify()
        if self._thread.ident is not None:
            self._thread.join(timeout=3.0)

    def _meet(self) -> None:
        """Agree on the rate with a robot that has just been connected.

        Raises:
            RobotError: It has no ALAudioDevice, or the link broke.
        """
        link = self._connection.connections
        call = self._connection.call
        now = self._robots_rate()
        if self._wanted and now != self._wanted:
            # Ignored on a real Pepper while the outputs are open.
            call(_DEVICE, "closeAudioOutputs", timeout=3.0)
            try:
                call(_DEVICE, "setParameter", "outputSampleRate", self._wanted)
            except CallRefused as error:
                log.warning("the robot stays at %d Hz: %s", now, error)
            call(_DEVICE, "openAudioOutputs", timeout=3.0)
            now = self._robots_rate()
        if now not in RATES:
            raise CallRefused(f"the robot plays {now} Hz, which is not one of {RATES}")
        self._link = link
        self.problem = None
        self._pending.clear()
        self._stalled = True  # whoever spoke before us may have left sound in the queue
        if now != self.rate:
            self.rate = now
            self._before.clear()
            self._talking = False
            self.on_rate()

    def _robots_rate(self) -> int:
        return int(number(self._connection.call(_DEVICE, "getParameter", "outputSampleRate"), "outputSampleRate"))

    def put(self, frames: bytes) -> None:
        """Sound from the microphone, from any one thread: int16 little-endian, stereo interleaved, at `rate`."""
        self._rest += frames
        size = self._size()
        while len(self._rest) >= size:
            piece, self._rest = self._rest[:size], self._rest[size:]
            with self._arrived:
                self._queue.append(piece)
                self._arrived.notify()

    def _size(self) -> int:
        return int(PIECE * self.rate) * _BYTES_PER_FRAME

    def _run(self) -> None:
        while True:
            with self._arrived:
                self._arrived.wait_for(lambda: self._queue or self._closing)
                if self._closing:
                    return
                overflow = len(self._queue) > BACKLOG
                if overflow:
                    self._queue.clear()
                    continue_with = None
                else:
                    continue_with = self._queue.popleft()
            try:
                if continue_with is None:
                    self._restart("the link is too slow for the microphone")
                else:
                    self._handle(continue_with, self._clock())
            except RobotError as error:
                self._fail(str(error))
            except Exception:  # top of the thread: the pilot's next word must have a chance
                log.exception("the pilot's voice cannot be sent")
                self._fail("it fails; the log says why")

    def _handle(self, piece: bytes, now: float) -> None:
        if now < self._pause_until:
            return
        if self._connection.connected and self._link != self._connection.connections:
            self._meet()
        if len(piece) != self._size():
            return  # of the rate before
        if level(piece) > QUIET:
            self._loud_until = now + HANGOVER
        if now > self._loud_until or not self._connection.connected:
            self._talking = False
            self._before.append(piece)
            return
        if self._still_stalled(now):
            self._before.append(piece)
            return
        if self._talking and self._drifted(now):
            self._restart("the clocks drifted apart")
        if self._talking:
            self._send(piece, now)
            return
        recent = [*self._before, piece]
        if self._stalled:
            self._flush()
            now = self._clock()
            with self._arrived:  # of what came meanwhile a cushion too: more would stay a delay
                recent = [*recent, *self._queue][-1 - (self._before.maxlen or 0) :]
                self._queue.clear()
        self._talking, self._since, self._sent = True, now, 0.0
        # In one call: a robot may serve calls that wait side by side in any order.
        self._send(b"".join(recent), now)
        self._before.clear()

    def _still_stalled(self, now: float) -> bool:
        """Whether calls wait for their answers for too long; notices when they do not any more."""
        while self._pending and self._pending[0][1].done:
            self._pending.popleft()[1].result()  # raises what went wrong
            self.problem = None
        if self._pending and now - self._pending[0][0] > STALL:
            if not self._stalled:
                log.info("the robot does not answer; its loudspeaker will be emptied before the next word")
            self._stalled, self._talking = True, False
            return True
        return self._stalled and bool(self._pending)

    def _drifted(self, now: float) -> bool:
        """Whether the robot's queue may have run dry or full, by our clock."""
        ahead = self._sent - (now - self._since)
        return not -PIECE < ahead < self._cushion + PIECE + DRIFT or now - self._since > RESYNC

    def _restart(self, why: str) -> None:
        log.debug("the loudspeaker's queue is emptied: %s", why)
        self._talking, self._stalled = False, True

    def _flush(self) -> None:
        """Empty the robot's queue, before the next word is under way: served side by side it could be dropped, too.

        Raises:
            RobotUnreachable: No answer.
        """
        try:
            self._connection.call(_DEVICE, "flushAudioOutputs")
        except CallRefused as error:
            log.debug("the loudspeaker is not emptied: %s", error)
        self.flushes += 1
        self._stalled = False

    def _send(self, frames: bytes, now: float) -> None:
        count = len(frames) // _BYTES_PER_FRAME
        self._pending.append((now, self._connection.call_async(_DEVICE, "sendRemoteBufferToOutput", count, frames)))
        self._sent += count / self.rate
        self.pieces += 1

    def _fail(self, problem: str) -> None:
        """Be silent after an error until the next word; report it once."""
        self._pending.clear()
        self._talking, self._stalled = False, True
        self._loud_until = 0.0
        self._pause_until = self._clock() + RETRY_PERIOD
        if problem != self.problem and self._connection.connected:
            log.warning("the robot does not play the pilot's voice: %s", problem)
        self.problem = problem


def level(piece: bytes) -> float:
    """Mean level of int16 samples [dBFS]; -100 for digital silence."""
    samples = np.frombuffer(piece, "<i2").astype(np.float32)
    power = float(np.mean(samples * samples)) / 32768.0**2 if len(samples) else 0.0
    return max(-100.0, 10.0 * float(np.log10(power + 1e-12)))
