"""Speech: text to samples with espeak-ng, and a voice that says texts one by one in real time. No NAOqi words."""

from __future__ import annotations

import concurrent.futures
import io
import logging
import re
import shutil
import subprocess
import threading
import time
import wave
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pepper_sim.sound.room import Loudspeaker, write_wave

log = logging.getLogger(__name__)

SPEAKER = "espeak-ng"
WORDS_PER_MINUTE = 175
"""espeak-ng's default, which is a speed of 100 %."""
_SYNTHESIS_TIMEOUT = 20.0
_SILENT_RATE = 16000
MIN_SPEED, MAX_SPEED = 20.0, 400.0
"""Slowest and fastest speech [%]."""


@dataclass(frozen=True)
class SpeechStyle:
    """How a text is said: espeak-ng's voice, speed [%], pitch [%], loudness 0 to 1."""

    voice: str = "en-us"
    speed: float = 100.0
    pitch: float = 100.0
    volume: float = 1.0


@dataclass
class Utterance:
    """A text in the queue; `future` is done when it has been said (true) or was interrupted (false), or has the error
    for which it could not be said.

    Attributes:
        number: Its owner's.
        bookmarks: For whoever follows the words: how many are before each, and its number.
    """

    text: str
    style: SpeechStyle
    bookmarks: Sequence[tuple[int, int]] = ()
    number: int = 0
    future: concurrent.futures.Future = field(default_factory=concurrent.futures.Future)


def synthesise(text: str, style: SpeechStyle) -> tuple[np.ndarray, int]:
    """Synthesise a text.

    Returns:
        Samples (float32, mono) and their rate [Hz]. Without espeak-ng it is silence of the text's length.
    """
    if shutil.which(SPEAKER) is None:
        return _silence(text, style)
    words_per_minute = WORDS_PER_MINUTE * min(max(style.speed, MIN_SPEED), MAX_SPEED) / 100.0
    pitch = min(max(50.0 * style.pitch / 100.0, 0.0), 99.0)
    command = [
        SPEAKER,
        "-v",
        style.voice,
        "-s",
        f"{words_per_minute:.0f}",
        "-p",
        f"{pitch:.0f}",
        "--stdin",
        "--stdout",
    ]
    try:
        done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=_SYNTHESIS_TIMEOUT, check=True)
        return _read_wave(done.stdout)
    except (subprocess.SubprocessError, OSError, wave.Error, EOFError) as error:
        log.warning("%s could not speak: %s", SPEAKER, error)
        return _silence(text, style)


def _read_wave(data: bytes) -> tuple[np.ndarray, int]:
    """Return samples and rate of a WAV stream. espeak-ng writes to a pipe, so the length in the header is wrong."""
    with wave.open(io.BytesIO(data)) as reader:
        rate = reader.getframerate()
    start = data.index(b"data") + 8
    samples = np.frombuffer(data[start : start + (len(data) - start) // 2 * 2], "<i2")
    return samples.astype(np.float32) / 32768.0, rate


def _silence(text: str, style: SpeechStyle) -> tuple[np.ndarray, int]:
    seconds = 60.0 * max(1, len(text.split())) / (WORDS_PER_MINUTE * style.speed / 100.0)
    return np.zeros(int(seconds * _SILENT_RATE), np.float32), _SILENT_RATE


class Voice:
    """Says texts one after the other through a loudspeaker.

    `on_begin(utterance)`, `on_word(word, position)`, `on_end(interrupted)` are called on the voice's thread. The time
    of a word is proportional to its position in the text.

    Args:
        last_spoken: WAV file that always holds the last text.
    """

    def __init__(self, loudspeaker: Loudspeaker, last_spoken: Path) -> None:
        self.last_spoken = last_spoken
        self.on_begin: Callable[[Utterance], None] = lambda utterance: None
        self.on_word: Callable[[str, int], None] = lambda word, position: None
        self.on_end: Callable[[bool], None] = lambda interrupted: None
        self._loudspeaker = loudspeaker
        self._changed = threading.Condition()
        self._queue: deque[Utterance] = deque()
        self._current: Utterance | None = None
        self._interrupt = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="voice", daemon=True)
        self._thread.start()

    def say(
        self, text: str, style: SpeechStyle, bookmarks: Sequence[tuple[int, int]] = (), number: int = 0
    ) -> concurrent.futures.Future:
        """Queue a text; see Utterance. Cancelling the future takes it out of the queue, or falls silent."""
        utterance = Utterance(text, style, bookmarks, number)
        utterance.future.add_done_callback(lambda done: self._cancelled(utterance) if done.cancelled() else None)
        with self._changed:
            if self._closed:
                utterance.future.set_result(False)
                return utterance.future
            self._queue.append(utterance)
            self._changed.notify()
        return utterance.future

    def waiting(self) -> int:
        """Return how many texts are being said or wait."""
        with self._changed:
            return len(self._queue) + (self._current is not None)

    def stop(self) -> None:
        """Fall silent: the text being said and all that wait end with False."""
        with self._changed:
            dropped = list(self._queue)
            self._queue.clear()
            if self._current is not None:
                self._interrupt.set()
        for utterance in dropped:
            _finish(utterance, False)

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self.stop()
        self._thread.join(timeout=5.0)

    def _cancelled(self, utterance: Utterance) -> None:
        with self._changed:
            if self._current is utterance:
                self._interrupt.set()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._queue or self._closed)
                if not self._queue:
                    return
                utterance = self._current = self._queue.popleft()
                self._interrupt.clear()
            said, failure = False, None
            try:
                if not utterance.future.cancelled():
                    said = self._speak(utterance)
            except Exception as error:  # callbacks of the owner; one text that fails must not end the voice
                log.exception("a text could not be said")
                failure = error
            with self._changed:
                self._current = None
            _finish(utterance, said, failure)

    def _speak(self, utterance: Utterance) -> bool:
        samples, rate = synthesise(utterance.text, utterance.style)
        write_wave(self.last_spoken, samples, rate)
        self.on_begin(utterance)
        interrupted = True
        try:
            interrupted = self._play(utterance, samples, rate)
        finally:
            self.on_end(interrupted)
        return not interrupted

    def _play(self, utterance: Utterance, samples: np.ndarray, rate: int) -> bool:
        """Play a text's samples; true if interrupted."""
        sound = self._loudspeaker.play(samples, rate, gain=utterance.style.volume)
        for moment, word, position in _words(utterance.text, len(samples) / rate):
            if self._wait_until(sound.start + moment):
                break
            self.on_word(word, position)
        interrupted = self._wait_until(sound.end)
        if interrupted:
            self._loudspeaker.track.cut(sound)
        return interrupted

    def _wait_until(self, moment: float) -> bool:
        """Wait until `moment` [s, monotonic]; true if interrupted."""
        return self._interrupt.wait(max(0.0, moment - time.monotonic()))


def _finish(utterance: Utterance, said: bool, failure: Exception | None = None) -> None:
    if not utterance.future.set_running_or_notify_cancel():
        return
    if failure is None:
        utterance.future.set_result(said)
    else:
        utterance.future.set_exception(failure)


def _words(text: str, duration: float) -> list[tuple[float, str, int]]:
    """Return (seconds from the start, word, position of its first letter) of every word."""
    return [(duration * position / max(1, len(text)), word, position) for word, position in words(text)]


def words(text: str) -> list[tuple[str, int]]:
    """Return the words of a text, each with the position of its first letter."""
    return [(match.group(), match.start()) for match in re.finditer(r"\w[\w'’-]*", text)]
