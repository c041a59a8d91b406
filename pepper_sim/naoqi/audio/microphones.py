"""Microphone buffers for clients: the room's sound in real time, block by block, to each client's processRemote.

    processRemote(channels, samples per channel, [seconds, microseconds], buffer of int16)

Nobody waits for the client's answer, and a client that does not read misses blocks. One whose service is gone, or
cannot be called three times in a row, is dropped. Sources: NAOqi 2.8 documentation, ALAudioDevice; block length as
naoqi_driver's users see it (85 ms).
"""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import dataclass

import numpy as np

from pepper_sim.body.description import MICROPHONES, SOUND_RATE, VOICE_RATE
from pepper_sim.naoqi.client_services import MAX_FAILURES, ClientServices
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.sound.room import Room

log = logging.getLogger(__name__)

BLOCK = {SOUND_RATE: 4096, VOICE_RATE: 1365}
"""Sample rate [Hz] -> samples per channel in a block."""
METHOD = "processRemote"
_PICKS = {1: 0, 2: 1, 3: 2, 4: 3}
"""Channel flag of the 16 kHz form -> microphone. NAOqi names the flags left, right, front and rear after NAO's head.
They count the channels, which on Pepper are rear left, rear right, front left, front right (`body.description`)."""


@dataclass(frozen=True)
class Preferences:
    """What a client subscribes to: all channels (0) at 48000 Hz, or one of them (1 to 4) at 16000 Hz."""

    rate: int = SOUND_RATE
    channels: int = 0
    deinterleaved: bool = False

    @property
    def count(self) -> int:
        """Channels in a buffer."""
        return MICROPHONES if self.channels == 0 else 1

    def cut(self, block: np.ndarray) -> np.ndarray:
        """Return the client's part of a block of (n, 4) samples, in the order of its buffer."""
        if self.channels:
            block = block[:, _PICKS[self.channels]]
        return np.ascontiguousarray(block.T if self.deinterleaved and self.channels == 0 else block)


class MicrophoneStream:
    """Delivers to one client until closed."""

    def __init__(self, name: str, preferences: Preferences, room: Room, clients: ClientServices) -> None:
        self.name = name
        self._preferences = preferences
        self._room = room
        self._clients = clients
        self._closing = threading.Event()
        self._failures = 0
        self._thread = threading.Thread(target=self._run, name=f"microphone-{name}"[:40], daemon=True)
        self._thread.start()

    @property
    def alive(self) -> bool:
        return self._thread.is_alive()

    def close(self) -> None:
        self._closing.set()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=3.0)

    def _run(self) -> None:
        rate, count = self._preferences.rate, BLOCK[self._preferences.rate]
        start = time.monotonic()
        try:
            while self._failures < MAX_FAILURES:
                end = start + count / rate
                if self._closing.wait(max(0.0, end - time.monotonic())):
                    return
                block = self._preferences.cut(self._room.listen(start, count, rate))
                stamp = split_stamp(time.time() - (time.monotonic() - start))
                if self._deliver(count, stamp, block):
                    self._failures = 0
                elif not self._clients.exists(self.name):
                    break
                else:
                    self._failures += 1
                late = time.monotonic() - end
                start = end if late < 1.0 else end + late
            log.warning("'%s' gets no more sound: its service is gone or fails", self.name)
        except Exception:  # top of a thread; one client's stream must not end without a trace
            log.exception("the microphones failed for '%s'", self.name)

    def _deliver(self, count: int, stamp: list[int], block: np.ndarray) -> bool:
        try:
            self._clients.post(self.name, METHOD, self._preferences.count, count, stamp, block)
        except RuntimeError as error:
            log.info("'%s' cannot be called: %s", self.name, error)
            return False
        return True
