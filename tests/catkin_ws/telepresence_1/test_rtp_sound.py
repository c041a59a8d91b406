"""The robot's sound by RTP through a network that loses, delays and swaps packets, and is cut.

How well it is concealed is judged at times that the test decides (`rtp_replay`); that the programs themselves go on is
seen on real sockets, with a real sound server.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from rtp_line import JITTER, LATE, LOSS, TEXT, Line, Talk
from rtp_replay import likeness, pack, spoil, unpack
from sound_lab import RATE, Recorder, SoundServer, sentence
from telepresence_1.rtp_sound import CODECS, RtpPlayer

pytestmark = pytest.mark.slow

CUT = (8.0, 18.0)
"""Seconds from the beginning."""
MEDIAN, MEAN = {"l16": 0.9, "opus": 0.97}, {"l16": 0.85, "opus": 0.97}
"""What remains of half a second of speech: L16 has holes where Opus guesses what was lost."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SoundServer]:
    server = SoundServer(tmp_path_factory.mktemp("sound"))
    os.environ.update(server.environment())
    yield server
    for name in server.environment():
        os.environ.pop(name, None)
    server.close()


@pytest.mark.parametrize("codec", CODECS)
def test_loss_and_jitter_are_concealed_and_a_cut_leaves_nothing_behind(codec: str) -> None:
    said = np.tile(sentence(TEXT), 8)
    packets = pack(said, codec)
    clean = unpack(spoil(packets, 0.0, 0.0), codec, LATE)
    assert min(likeness(said, clean, 1.0, len(said) / RATE - 1.0)) > 0.95, "nothing happened to these packets"
    arrivals = spoil(packets, LOSS, JITTER, CUT)
    heard = unpack(arrivals, codec, LATE)
    assert len(heard) / RATE == pytest.approx(len(said) / RATE, abs=0.1), "what is missing shifts what follows"
    for what, begin, end in (("before", 2.0, CUT[0]), ("after", CUT[1] + 0.5, len(said) / RATE - 1.0)):
        found = likeness(said, heard, begin, end)
        print(f"{codec} {what} the cut: median {np.median(found):.3f}, mean {np.mean(found):.3f}, min {min(found):.2f}")
        assert np.median(found) > MEDIAN[codec] and np.mean(found) > MEAN[codec], f"{what} the cut: {found}"
    middle = heard[round((CUT[0] + 0.5) * RATE) : round((CUT[1] - 0.5) * RATE)]
    assert np.abs(middle).max() < 0.01, "silence where there is nothing"


def test_sound_goes_on_and_returns_by_itself_after_a_cut(
    server: SoundServer, free_port: Callable[[], int], wait_until: Callable
) -> None:
    """Sound also returns after the sound server was gone."""
    sink = "pilot_speaker"
    line = Line(server, "opus", sink, free_port())
    talk = Talk([line])

    def expect(heard: bool, when: str) -> None:
        wait_until(lambda: (line.ear.level() > 0.01) == heard, f"sound {when}: {heard}")

    try:
        expect(True, "through loss and jitter")
        wait_until(lambda: line.network.lost > 0, "packets got lost")
        line.network.cut = True
        expect(False, "while nothing gets through")
        line.network.cut = False
        expect(True, "after the cut")
        server.close()
        wait_until(lambda: line.player.pipeline.problem, "the loss of the sound server is noticed")
        server.start()
        wait_until(lambda: line.player.pipeline.problem is None, "it plays again")
        line.ear.close()
        line.ear = Recorder(server, f"{sink}.monitor")
        expect(True, "with the new sound server")
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
