"""The robot's sound by RTP through a network that loses, delays and swaps packets, and is cut."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from telepresence_1.rtp_sound import CODECS, RtpPlayer, RtpSender

sys.path.append(str(Path(__file__).resolve().parents[2] / "lab"))

from bad_network import BadNetwork
from sound_lab import RATE, Recorder, SoundServer, match, sentence

TEXT = "One two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen."
BLOCK = 4096
SINKS = {"l16": "pilot_speaker", "opus": "robot_speaker"}


class Line:
    """One sender, a bad network, one player, and an ear."""

    def __init__(self, server: SoundServer, codec: str, port: int) -> None:
        self.network = BadNetwork(port, loss=0.02, jitter=0.05)
        self.player = RtpPlayer(SINKS[codec], port=port, codec=codec, jitter=0.08).start()
        self.sender = RtpSender(RATE, 2, port=self.network.port, codec=codec).start()
        self.ear = Recorder(server, f"{SINKS[codec]}.monitor")
        self.played: list[tuple[float, np.ndarray]] = []

    def close(self) -> None:
        for part in (self.sender, self.network, self.player, self.ear):
            part.close()


class Talk:
    """Gives every line the same endless speech, in blocks at their real rate."""

    def __init__(self, lines: list[Line]) -> None:
        self.sound = np.tile(sentence(TEXT), 8)
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
                found.append(match(said, line.ear.between(at, at + piece + 0.6))[0])
        return found


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SoundServer]:
    server = SoundServer(tmp_path_factory.mktemp("sound"))
    os.environ.update(server.environment())
    yield server
    for name in server.environment():
        os.environ.pop(name, None)
    server.close()




def test_sound_goes_on_through_loss_jitter_and_a_cut(
    server: SoundServer, free_port: Callable[[], int], wait_until: Callable
) -> None:
    lines = {codec: Line(server, codec, free_port()) for codec in CODECS}
    talk = Talk(list(lines.values()))
    try:
        for codec, line in lines.items():
            wait_until(lambda line=line: line.ear.level() > 0.01, f"{codec} is heard")
        begin = time.monotonic()
        time.sleep(4.5)
        end = time.monotonic() - 1.0
        for codec, line in lines.items():
            likeness = talk.likeness(line, begin, end)
            print(f"{codec} with loss and jitter: {[f'{value:.2f}' for value in likeness]}, {line.player.packets()}")
            assert line.network.lost > 0
            assert np.median(likeness) > 0.9 and min(likeness) > 0.6, f"{codec}: {likeness}"
        for line in lines.values():
            line.network.cut = True
        for codec, line in lines.items():
            wait_until(lambda line=line: line.ear.level() < 0.002, f"{codec} is cut")
        time.sleep(1.5)
        for line in lines.values():
            line.network.cut = False
        for codec, line in lines.items():
            wait_until(lambda line=line: line.ear.level() > 0.01, f"{codec} is heard again", 10.0)
        begin = time.monotonic() + 0.5
        time.sleep(3.0)
        end = time.monotonic() - 1.0
        for codec, line in lines.items():
            likeness = talk.likeness(line, begin, end)
            print(f"{codec} after the cut: {[f'{value:.2f}' for value in likeness]}, {line.player.packets()}")
            assert np.median(likeness) > 0.9, f"{codec}: {likeness}"
    finally:
        talk.close()
        for line in lines.values():
            line.close()


def test_a_sound_server_that_comes_back_is_used_again(
    server: SoundServer, free_port: Callable[[], int], wait_until: Callable
) -> None:
    line = Line(server, "l16", free_port())
    talk = Talk([line])
    try:
        wait_until(lambda: line.player.pipeline.problem is None and line.player.packets()[0] > 20, "it plays")
        server.close()
        wait_until(lambda: line.player.pipeline.problem, "the loss is noticed")
        server.start()
        wait_until(lambda: line.player.pipeline.problem is None, "it plays again")
        line.ear.close()
        line.ear = Recorder(server, f"{SINKS['l16']}.monitor")
        wait_until(lambda: line.ear.level() > 0.01, "it is heard again")
    finally:
        talk.close()
        line.close()


def test_a_port_that_is_taken_is_told(server: SoundServer, free_port: Callable[[], int], wait_until: Callable) -> None:
    port = free_port()
    first = RtpPlayer("test", port=port).start()
    wait_until(lambda: first.pipeline.problem is None, "the first has the port")
    second = RtpPlayer("test", port=port).start()
    try:
        wait_until(lambda: second.pipeline.problem not in (None, "not started yet"), "the second says why not")
    finally:
        second.close()
        first.close()
