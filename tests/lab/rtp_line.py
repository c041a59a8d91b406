"""The robot's sound by RTP through a bad network: sender, network, player, recorder; and endless speech for them."""

from __future__ import annotations

import itertools
import threading
import time

import numpy as np
from bad_network import BadNetwork
from sound_lab import RATE, Recorder, SoundServer, match, sentence
from telepresence_1.rtp_sound import RtpPlayer, RtpSender

TEXT = "One two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen."
BLOCK = 4096
LOSS, JITTER = 0.02, 0.05
LATE = 0.08
"""Seconds that the player waits for a late packet."""
BUSY = 0.15
"""Seconds for which this machine may be busy with other programs."""
LONGEST = LATE + 2 * BUSY + 0.5
"""A sound is played at most so long [s] after it was said, or not at all."""
PIECE = 0.5
"""Seconds of speech that are compared at once."""


class Line:
    """One sender, a network, one player, and a recorder.

    Args:
        sink: Name of the sound server's sink that it plays on; one for each line.
        port: UDP port of the player.
        loss, jitter: See `BadNetwork`; 0 for a line to compare others with.
    """

    def __init__(
        self,
        server: SoundServer,
        codec: str,
        sink: str,
        port: int,
        loss: float = LOSS,
        jitter: float = JITTER,
    ) -> None:
        self.network = BadNetwork(port, loss, jitter)
        self.player = RtpPlayer(sink, port=port, codec=codec, jitter=LATE, patience=BUSY).start()
        self.sender = RtpSender(RATE, 2, port=self.network.port, codec=codec, patience=BUSY).start()
        self.ear = Recorder(server, f"{sink}.monitor")

    def close(self) -> None:
        for part in (self.sender, self.network, self.player, self.ear):
            part.close()


class Talk:
    """Gives every line the same endless speech, in blocks at their real rate."""

    def __init__(self, lines: list[Line]) -> None:
        self.sound = sentence(TEXT)
        self.start = time.monotonic()
        self._lines = lines
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join(5.0)

    def said(self, begin: float, seconds: float) -> np.ndarray:
        """What was or will be said from a moment on."""
        first = round((begin - self.start) * RATE)
        return np.take(self.sound, np.arange(first, first + round(seconds * RATE)), mode="wrap")

    def _run(self) -> None:
        for number in itertools.count():
            begin = self.start + number * BLOCK / RATE
            if self._stop.wait(max(0.0, begin + BLOCK / RATE - time.monotonic())):
                return
            mono = self.said(begin, BLOCK / RATE)
            block = np.repeat((mono * 32767).astype(np.int16)[:, None], 2, axis=1)
            for line in self._lines:
                line.sender.push(block, time.monotonic())

    def likeness(self, line: Line, begin: float, end: float) -> dict[float, float]:
        """Moment -> how well what was said then reached the recorder, for every loud piece between two moments."""
        found = {}
        for at in np.arange(begin, end - PIECE, PIECE):
            said = self.said(at, PIECE)
            if np.sqrt(np.mean(said**2)) > 0.02:
                found[float(at)] = match(said, line.ear.between(at, at + PIECE + LONGEST))[0]
        return found
