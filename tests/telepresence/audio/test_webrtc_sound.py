"""A track without a microphone."""

import asyncio

from telepresence.audio import webrtc_sound
from telepresence.audio.webrtc_sound import SAMPLES, MicrophoneTrack


def test_a_pilot_without_a_microphone_sends_signs_of_life(monkeypatch):
    monkeypatch.setattr(webrtc_sound, "LIFE_PERIOD", 0.01)

    async def take_two():
        track = MicrophoneTrack()
        frames = [await track.recv(), await track.recv()]
        track.put(b"\1" * 4 * SAMPLES)
        return [*frames, await track.recv()]

    first, second, spoken = asyncio.run(take_two())
    assert [frame.pts for frame in (first, second, spoken)] == [0, SAMPLES, 2 * SAMPLES]
    assert not any(bytes(first.planes[0])) and any(bytes(spoken.planes[0]))
