"""One encoding of a robot's sound for everybody who listens."""

from __future__ import annotations

import asyncio
import time

import av
import numpy as np
import pytest

from telepresence.audio.webrtc_sound import RATE, SAMPLES
from telepresence.page.shared_sound import MOST_WAITING, SharedSound


class Robot:
    """Its microphone, which delivers blocks of 85 ms."""

    def __init__(self):
        self.take = None
        self.told = []

    def listen(self, take):
        self.take = take
        self.told.append(take is not None)

    def record(self, seconds, rate=16000, channels=1, begin=0.0):
        at = begin + np.arange(round(seconds * rate)) / rate
        tone = (8000 * np.sin(2 * np.pi * 440 * at)).astype("<i2")
        self.take(np.repeat(tone, channels).tobytes(), rate, channels)


def decoded(packets):
    decoder = av.AudioCodecContext.create("libopus", "r")
    frames = [frame for packet in packets for frame in decoder.decode(av.Packet(bytes(packet)))]
    return np.concatenate([frame.to_ndarray().reshape(-1)[::2] for frame in frames])  # it decodes to stereo


def test_two_listeners_get_the_same_packets_evenly_and_nobody_s_absence_ends_it():
    async def scenario():
        robot = Robot()
        sound = SharedSound(robot.listen)
        tracks = [sound.track(), sound.track()]
        assert robot.told == []
        for track in tracks:
            track.listens = True
        got, came = ([], []), []

        async def take(number):
            while len(got[number]) < 25:
                got[number].append(await tracks[number].recv())
                if number == 0:
                    came.append(time.monotonic())

        tasks = [asyncio.ensure_future(take(number)) for number in (0, 1)]
        for block in range(12):
            await asyncio.sleep(0.085)  # no burst after a hold-up: that would be left out
            robot.record(0.085, channels=1, begin=0.085 * block)
        await asyncio.wait_for(asyncio.gather(*tasks), 10)
        assert all(one is other for one, other in zip(*got, strict=True)), "one encoding serves both"
        stamps = np.diff([packet.pts for packet in got[0]])
        assert (stamps >= SAMPLES).all() and np.median(stamps) == SAMPLES
        assert 0.005 < np.median(np.diff(came)) < 0.05, "blocks of 85 ms leave in pieces of 20 ms"
        spectrum = np.abs(np.fft.rfft(decoded(got[0])[-RATE // 4 :], RATE))
        assert np.argmax(spectrum) == pytest.approx(440, abs=5)
        tracks[0].stop()
        assert sound.listeners == 1
        tracks[1].listens = False
        assert robot.told == [True, False] and sound.listeners == 0

    asyncio.run(scenario())


def test_a_slow_listener_loses_sound_and_keeps_no_more_than_a_little():
    async def scenario():
        robot = Robot()
        track = SharedSound(robot.listen).track()
        track.listens = True
        for block in range(10):
            robot.record(0.085, 48000, 2, 0.085 * block)
            await asyncio.sleep(0.085)
        assert len(track._packets) == MOST_WAITING
        track.stop()

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("frames", "rate", "channels"), [(b"", 48000, 1), (b"abc", 48000, 1), (bytes(200), 1, 1), (bytes(200), 48000, 0)]
)
def test_what_is_no_sound_is_left_out(frames, rate, channels):
    async def scenario():
        robot = Robot()
        sound = SharedSound(robot.listen)
        track = sound.track()
        track.listens = True
        robot.take(frames, rate, channels)
        await asyncio.sleep(0)
        assert not sound._waiting
        track.stop()

    asyncio.run(scenario())
