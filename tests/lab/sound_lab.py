"""A sound server without a sound card, players and recorders on it, and how alike and how late two sounds are.

PulseAudio with null sinks: what is played into `pilot_mic` is what the microphone `pilot_mic.monitor` records. Times
are `time.monotonic()` [s], samples mono float32, -1 to 1.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
import threading
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pepper_sim.sound.speech import SpeechStyle, synthesise
from telepresence.audio.pipeline import Gst
from telepresence.station import processes

RATE = 48000
SINKS = ("pilot_mic", "pilot_speaker", "robot_mic", "robot_speaker")
START_TIMEOUT = 20.0


class SoundServer:
    """A PulseAudio of its own, on its own socket, with one null sink per name."""

    def __init__(self, folder: Path, sinks: Sequence[str] = SINKS) -> None:
        self._folder, self._sinks = folder, sinks
        folder.mkdir(parents=True, exist_ok=True)
        self._socket = folder / "native"
        self.address = f"unix:{self._socket}"
        self._process: subprocess.Popen | None = None
        self.start()

    def environment(self) -> dict[str, str]:
        """What programs need to find it."""
        return {"PULSE_SERVER": self.address}

    def start(self) -> None:
        command = ["pulseaudio", "-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--disallow-exit"]
        modules = [f"module-native-protocol-unix socket={self._socket} auth-anonymous=1"]
        modules += [f"module-null-sink sink_name={name} rate={RATE} channels=2" for name in self._sinks]
        for module in modules:
            command += ["-L", module]
        home = {"HOME": str(self._folder), "XDG_RUNTIME_DIR": str(self._folder / "run")}
        with (self._folder / "pulseaudio.log").open("a") as log:
            self._process = processes.start(
                command, env={**os.environ, **home}, stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )
        deadline = time.monotonic() + START_TIMEOUT
        while not self.answers():
            if time.monotonic() > deadline or self._process.poll() is not None:
                raise RuntimeError(f"no PulseAudio: {(self._folder / 'pulseaudio.log').read_text()[-2000:]}")
            time.sleep(0.05)

    def answers(self) -> bool:
        return self._pactl("info").returncode == 0

    def listeners(self, source: str) -> int:
        """Return how many streams have this microphone open."""
        sources, streams = (self._pactl("list", "short", kind).stdout for kind in ("sources", "source-outputs"))
        number = next(line.split("\t")[0] for line in sources.splitlines() if line.split("\t")[1] == source)
        return sum(line.split("\t")[1] == number for line in streams.splitlines())

    def unplug(self, sink: str) -> None:
        """Take a sink away, and the microphone that is its monitor."""
        for line in self._pactl("list", "short", "modules").stdout.splitlines():
            if f"sink_name={sink} " in line:
                self._pactl("unload-module", line.split("\t")[0])

    def plug(self, sink: str) -> None:
        """Bring a sink back."""
        self._pactl("load-module", "module-null-sink", f"sink_name={sink}", f"rate={RATE}", "channels=2")

    def _pactl(self, *words: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, **self.environment(), "HOME": str(self._folder)}
        return subprocess.run(["pactl", *words], env=environment, capture_output=True, text=True)

    def close(self) -> None:
        if self._process is not None:
            processes.end(self._process, patience=3.0)
            self._process = None


class Recorder:
    """Listens to a microphone from construction until `close`.

    A sample's time is when it had arrived here, so that delays come out too long rather than too short. The quickest of
    the newest arrivals counts: what a busy machine drops for ever would else make everything after it seem early.
    """

    WINDOW = 10.0
    """[s]"""

    def __init__(self, server: SoundServer, device: str) -> None:
        self._lock = threading.Lock()
        self._pieces: list[np.ndarray] = []
        self._count = 0
        self._forgotten = 0
        self._offset = float("inf")
        self._arrivals: deque[tuple[float, float]] = deque()
        """(when, offset) of the newest arrivals, without those that a later one was quicker than: offsets rise."""
        self._pipeline = Gst.parse_launch(
            f"pulsesrc server={server.address} device={device} buffer-time=2000000 latency-time=5000 ! audioconvert ! "
            f"audio/x-raw,format=S16LE,rate={RATE},channels=1 ! appsink name=out emit-signals=true sync=false"
        )
        self._pipeline.get_by_name("out").connect("new-sample", self._take)
        self._pipeline.set_state(Gst.State.PLAYING)
        deadline = time.monotonic() + START_TIMEOUT
        while not self._pieces:
            if time.monotonic() > deadline:
                raise RuntimeError(f"nothing comes from {device}")
            time.sleep(0.01)

    def between(self, start: float, stop: float) -> np.ndarray:
        """Return what was recorded; silence where nothing was recorded."""
        with self._lock:
            heard = np.concatenate([*self._pieces, np.zeros(0, np.int16)])
            first = round((start - self._offset) * RATE) - self._forgotten if self._pieces else 0
        wanted = np.zeros(round((stop - start) * RATE), np.float32)
        source = heard[max(0, first) : max(0, first + len(wanted))]
        at = max(0, -first)
        wanted[at : at + len(source)] = source.astype(np.float32) / 32768.0
        return wanted

    def forget(self, before: float) -> None:
        """Drop what was recorded before a moment."""
        with self._lock:
            keep = max(0, round((before - self._offset) * RATE)) - self._forgotten
            while self._pieces and keep >= len(self._pieces[0]):
                gone = len(self._pieces.pop(0))
                keep -= gone
                self._forgotten += gone

    def level(self, seconds: float = 0.3) -> float:
        """Mean amplitude of the newest sound."""
        with self._lock:
            newest = np.concatenate([*self._pieces[-int(seconds * 200) :], np.zeros(1, np.int16)])
        return float(np.sqrt(np.mean((newest.astype(np.float64) / 32768.0) ** 2)))

    def close(self) -> None:
        self._pipeline.set_state(Gst.State.NULL)

    def _take(self, sink: Gst.Element) -> Gst.FlowReturn:
        now = time.monotonic()
        buffer = sink.emit("pull-sample").get_buffer()
        piece = np.frombuffer(buffer.extract_dup(0, buffer.get_size()), "<i2")
        with self._lock:
            self._pieces.append(piece)
            self._count += len(piece)
            offset = now - self._count / RATE
            while self._arrivals and self._arrivals[-1][1] >= offset:
                self._arrivals.pop()
            self._arrivals.append((now, offset))
            while self._arrivals[0][0] < now - self.WINDOW:
                self._arrivals.popleft()
            self._offset = self._arrivals[0][1]
        return Gst.FlowReturn.OK


class Mouth:
    """Plays into a null sink; what a person says into the microphone that is its monitor."""

    def __init__(self, server: SoundServer, sink: str) -> None:
        self._server, self._sink = server, sink
        self._players: list[subprocess.Popen] = []

    def say(self, samples: np.ndarray) -> None:
        """Begin to play and return at once. It takes a tenth of a second to begin: listen to it to know when."""
        self._players = [player for player in self._players if player.poll() is None]
        # A long buffer, because a person's speech does not stutter when the machine is busy.
        command = ["pacat", "--playback", f"--server={self._server.address}", f"--device={self._sink}"]
        command += ["--raw", "--format=s16le", f"--rate={RATE}", "--channels=1", "--latency-msec=500"]
        with tempfile.TemporaryFile() as data:
            data.write((np.clip(samples, -1.0, 1.0) * 32767.0).astype("<i2").tobytes())
            data.seek(0)
            self._players.append(processes.start(command, stdin=data, stderr=subprocess.DEVNULL))

    def close(self) -> None:
        for player in self._players:
            processes.end(player, patience=1.0)


def sentence(text: str, voice: str = "en-us", amplitude: float = 0.5) -> np.ndarray:
    """A text as espeak-ng says it, at `RATE`, without the silence at its ends."""
    samples, rate = synthesise(text, SpeechStyle(voice=voice))
    loud = np.flatnonzero(np.abs(samples) > 0.01)
    samples = samples[loud[0] : loud[-1]]
    at = np.arange(int(len(samples) * RATE / rate)) * rate / RATE
    spoken = np.interp(at, np.arange(len(samples)), samples).astype(np.float32)
    return spoken * np.float32(amplitude / np.abs(spoken).max())


def match(sound: np.ndarray, heard: np.ndarray) -> tuple[float, float]:
    """Where and how well `sound` is found in `heard`.

    Returns:
        The greatest normalised cross-correlation, 0 to 1, and its place in `heard` [s].
    """
    size = 1 << int(np.ceil(np.log2(len(sound) + len(heard))))
    product = np.fft.irfft(np.fft.rfft(heard, size) * np.conj(np.fft.rfft(sound, size)), size)
    places = max(1, len(heard) - len(sound) + 1)
    energy = np.concatenate([[0.0], np.cumsum(heard.astype(np.float64) ** 2)])
    window = energy[len(sound) : len(sound) + places] - energy[:places]
    window = np.maximum(window, 1e-3 * float(window.max(initial=0.0)) + 1e-12)  # silence resembles nothing
    score = product[:places] / np.sqrt(window * float(np.sum(sound.astype(np.float64) ** 2)))
    best = int(np.argmax(score))
    return float(score[best]), best / RATE


class Heard:
    """How well every half second of a sentence has come through so far, the best of all times that it was said.

    A machine that stands still for a moment spoils what is said in that moment; said again, it spoils another one.
    """

    PIECE = 0.5

    def __init__(self, sound: np.ndarray) -> None:
        count = int(self.PIECE * RATE)
        firsts = range(0, len(sound) - count + 1, count)
        self._sound = sound
        self._best = {at: (0.0, 0.0) for at in firsts if np.sqrt(np.mean(sound[at : at + count] ** 2)) > 0.02}

    def listen(self, started: float, ear: Recorder, latest: float = 1.0) -> None:
        """Compare after the sentence was said from `started` on; a sound may be `latest` seconds late."""
        for at, best in self._best.items():
            begin = started + at / RATE
            piece = self._sound[at : at + int(self.PIECE * RATE)]
            self._best[at] = max(best, match(piece, ear.between(begin, begin + self.PIECE + latest)))

    @property
    def worst(self) -> float:
        """Likeness of the piece that came through worst, 0 to 1."""
        return min(likeness for likeness, _ in self._best.values())

    def __str__(self) -> str:
        delay = float(np.median([delay for _, delay in self._best.values()]))
        pieces = ", ".join(f"{likeness:.2f}" for likeness, _ in self._best.values())
        return f"likeness {pieces}; delay {delay * 1e3:.0f} ms"
