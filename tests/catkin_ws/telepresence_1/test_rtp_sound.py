"""The robot's sound by RTP through a network that loses, delays and swaps packets, and is cut."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from telepresence_1.rtp_sound import CODECS, RtpPlayer

sys.path.append(str(Path(__file__).resolve().parents[2] / "lab"))

from rtp_line import SINKS, Line, Talk
from sound_lab import Recorder, SoundServer

LIKENESS = {"l16": 0.8, "opus": 0.9}
"""What remains of half a second of speech: L16 has holes where Opus guesses what was lost."""


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
        time.sleep(3.5)
        end = time.monotonic() - 1.0
        for codec, line in lines.items():
            likeness = talk.likeness(line, begin, end)
            print(f"{codec} with loss and jitter: {[f'{value:.2f}' for value in likeness]}, {line.player.packets()}")
            assert line.network.lost > 0
            assert np.median(likeness) > LIKENESS[codec] and min(likeness) > 0.5, f"{codec}: {likeness}"
        for line in lines.values():
            line.network.cut = True
        for codec, line in lines.items():
            wait_until(lambda line=line: line.ear.level() < 0.002, f"{codec} is cut")
        time.sleep(1.0)
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
            assert np.median(likeness) > LIKENESS[codec], f"{codec}: {likeness}"
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
