"""The robot's sound by RTP through a bad network: sender, network, player, ear; and endless speech for them."""

from __future__ import annotations

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
"""Seconds that this machine may be busy with others."""
SINKS = {"l16": "pilot_speaker", "opus": "robot_speaker"}


class Line:
    """One sender, a bad network, one player, and an ear.

    Args:
        port: UDP port of the player.
    """

    def __init__(self, server: SoundServer, codec: str, port: int) -> None:
        self.network = BadNetwork(port, LOSS, JITTER)
        self.player = RtpPlayer(SINKS[codec], port=port, codec=codec, jitter=LATE, patience=BUSY).start()
        self.sender = RtpSender(RATE, 2, port=self.network.port, codec=codec, patience=BUSY).start()
        self.ear = Recorder(server, f"{SINKS[codec]}.monitor")

    def close(self) -> None:
        for part in (self.sender, self.network, self.player, self.ear):
            part.close()


class Talk:
    """Gives every line the same endless speech, in blocks at their real rate."""

    def __init__(self, lines: list[Line], repeats: int = 8) -> None:
        self.sound = np.tile(sentence(TEXT), repeats)
        self.start = time.monotonic()
        self._lines = lines
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join(5.0)

    def _run(self) -> None:
        for number in range(len(self.sound) // BLOCK):
            due = self.start + (number + 1) * BLOCK / RATE
            if self._stop.wait(max(0.0, due - time.monotonic())):
                return
            mono = self.sound[number * BLOCK : (number + 1) * BLOCK]
            block = np.repeat((mono * 32767).astype(np.int16)[:, None], 2, axis=1)
            for line in self._lines:
                line.sender.push(block, time.monotonic())

    def likeness(self, line: Line, begin: float, end: float, piece: float = 0.5) -> list[float]:
        """Of every piece that was said between two moments, as the line's ear heard it."""
        found = []
        for at in np.arange(begin, end - piece, piece):
            first = round((at - self.start) * RATE)
            said = self.sound[first : first + round(piece * RATE)]
            if np.sqrt(np.mean(said**2)) > 0.02:
                found.append(match(said, line.ear.between(at, at + piece + 1.0))[0])
        return found
