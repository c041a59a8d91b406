"""Pictures leave the jitter buffer with their last packet, sound whatever was lost; connections on an address of one's
choice."""

from __future__ import annotations

import asyncio
import importlib.metadata
import random
import time
from dataclasses import dataclass
from types import SimpleNamespace

import aiortc.rtcrtpreceiver
import numpy as np
import pytest
from aiortc import RTCSessionDescription
from aiortc.jitterbuffer import JitterBuffer

from telepresence.video import images, webrtc
from telepresence.video.frame_timestamp import read_age
from telepresence.video.images import LatestImage


@dataclass
class Packet:
    """The fields that the jitter buffer reads."""

    sequence_number: int
    timestamp: int
    marker: bool
    _data: bytes


def packets(pictures: int, size: int, first: int = 65530) -> list[Packet]:
    """Return the packets of so many pictures, each `size` packets, numbered over the wrap."""
    return [
        Packet((first + p * size + i) % 65536, 3000 * p, i == size - 1, b"%d.%d " % (p, i))
        for p in range(pictures)
        for i in range(size)
    ]


def released(buffer: JitterBuffer, stream: list[Packet]) -> list[tuple[int, bytes]]:
    """(index of the packet, data) for every picture that came out."""
    out = []
    for index, packet in enumerate(stream):
        _, frame = buffer.add(packet)
        if frame is not None:
            out.append((index, frame.data))
    return out


def test_a_picture_comes_with_its_last_packet():
    out = released(webrtc.PromptJitterBuffer(512, is_video=True), packets(5, 4))
    assert [index for index, _ in out] == [3, 7, 11, 15, 19]
    assert out[1][1] == b"1.0 1.1 1.2 1.3 "


def test_the_library_alone_waits_for_the_next_picture():
    """If this fails, aiortc has learned it, and PromptJitterBuffer can go."""
    out = released(JitterBuffer(512, is_video=True), packets(5, 4))
    assert [index for index, _ in out] == [4, 8, 12, 16]


def test_pictures_stay_whole_and_in_order_when_packets_are_late():
    stream = packets(6, 4)
    stream.insert(11, stream.pop(5))  # retransmitted six packets later
    out = released(webrtc.PromptJitterBuffer(512, is_video=True), stream)
    assert [data for _, data in out] == [
        data for _, data in released(webrtc.PromptJitterBuffer(512, is_video=True), packets(6, 4))
    ]


def test_without_markers_it_is_as_slow_as_the_library_and_no_worse():
    stream = packets(4, 3)
    for packet in stream:
        packet.marker = False
    assert released(webrtc.PromptJitterBuffer(512, is_video=True), stream) == released(
        JitterBuffer(512, is_video=True), stream
    )


def sound(count: int, lost: set[int], first: int = 65530) -> list[Packet]:
    """Packets of 20 ms each, but those that are lost."""
    return [Packet((first + n) % 65536, 960 * n, True, b"%d" % n) for n in range(count) if n not in lost]


def delays(out: list[tuple[int, bytes]], stream: list[Packet]) -> list[int]:
    """How many packets later, by their numbers, each piece of sound came out."""
    return [stream[index].timestamp // 960 - int(data) for index, data in out]


def test_lost_sound_costs_its_own_length_and_no_delay():
    """2 % of packets and a burst of five, then a cut."""
    chance = random.Random(1)
    lost = {n for n in range(20, 1000) if chance.random() < 0.02} | set(range(500, 505)) | set(range(700, 1000))
    stream = sound(1200, lost)
    out = released(webrtc.PromptJitterBuffer(16, prefetch=4), stream)
    heard = [int(data) for _, data in out]
    waited = set(range(690, 700))
    """When the cut began; it may be gone."""
    assert heard == sorted(heard) and set(heard) | waited | lost >= set(range(1196)), "everything that came, in order"
    late = delays(out, stream)
    assert late[-100:] == [4] * 100 and np.median(late) == 4, "as late at the end as at the beginning"


def test_overtaken_sound_is_put_in_order():
    stream = sound(60, set())
    stream.insert(33, stream.pop(30))
    out = released(webrtc.PromptJitterBuffer(16, prefetch=4), stream)
    assert [int(data) for _, data in out] == list(range(56))


def test_the_library_alone_stays_late_after_one_lost_packet_of_sound():
    """If this fails, aiortc has learned it."""
    stream = sound(300, {50})
    late = delays(released(JitterBuffer(16, prefetch=4), stream), stream)
    assert max(late[:40]) == 4 and min(late[-100:]) > 10


def test_only_the_known_version_is_touched(monkeypatch, caplog):
    assert importlib.metadata.version("aiortc") == webrtc.KNOWN_VERSION, "look at JitterBuffer again, then raise it"
    monkeypatch.setattr(aiortc.rtcrtpreceiver, "JitterBuffer", JitterBuffer)
    monkeypatch.setattr(webrtc.importlib.metadata, "version", lambda name: "1.17.0")
    assert webrtc.release_early() is False
    assert aiortc.rtcrtpreceiver.JitterBuffer is JitterBuffer
    assert "1.17.0" in caplog.text
    monkeypatch.undo()
    monkeypatch.setattr(aiortc.rtcrtpreceiver, "JitterBuffer", JitterBuffer)
    assert webrtc.release_early() is True
    assert aiortc.rtcrtpreceiver.JitterBuffer is webrtc.PromptJitterBuffer


def test_loopback_alone_is_offered_when_asked_for():
    async def offer(address):
        peer = webrtc.peer_connection()
        peer.createDataChannel("none")
        try:
            with webrtc.on_address(address):
                await peer.setLocalDescription(await peer.createOffer())
            return [line for line in peer.localDescription.sdp.splitlines() if line.startswith("a=candidate")]
        finally:
            await peer.close()

    (candidate,) = asyncio.run(offer("127.0.0.1"))
    assert " 127.0.0.1 " in candidate
    assert not any(" 127.0.0.1 " in line for line in asyncio.run(offer(None)))
    assert webrtc.address_towards("127.0.0.1") == "127.0.0.1"


def test_newest_picture_crosses_with_its_time():
    """Two connections in one process: what was put last arrives, older pictures are skipped, the age is true."""

    async def exchange():
        source, arrived = LatestImage(), []
        sender, receiver = webrtc.peer_connection(), webrtc.peer_connection()
        with webrtc.on_address("127.0.0.1"):
            receiver.addTransceiver("video", direction="recvonly")
            await receiver.setLocalDescription(await receiver.createOffer())
            await sender.setRemoteDescription(RTCSessionDescription(receiver.localDescription.sdp, "offer"))
            sender.addTrack(webrtc.NewestPictureTrack(source, with_time=True))
            await sender.setLocalDescription(await sender.createAnswer())
        for _ in range(50):
            source.put(np.zeros((360, 320), np.uint8))  # before anybody is connected
        await receiver.setRemoteDescription(RTCSessionDescription(sender.localDescription.sdp, "answer"))

        def take(frame):
            pixels = frame.to_ndarray(format="bgr24")
            arrived.append((pixels, read_age(pixels, time.time())))

        draining = asyncio.ensure_future(webrtc.drain(receiver.getTransceivers()[0].receiver.track, take))
        deadline = asyncio.get_running_loop().time() + 20
        while len(arrived) < 5 and asyncio.get_running_loop().time() < deadline:
            source.put(np.full((360, 320), 200, np.uint8))
            await asyncio.sleep(0.04)
        await sender.close()
        await asyncio.wait_for(draining, 5)
        await receiver.close()
        return arrived

    arrived = asyncio.run(exchange())
    assert len(arrived) >= 5
    dark = [pixels for pixels, _ in arrived if pixels[:100].mean() < 30]
    assert len(dark) <= 1, "at most the newest of those that nobody waited for"
    ages = [age for _, age in arrived]
    assert None not in ages
    assert all(-0.01 < age < 10 for age in ages)


def test_a_track_sends_no_picture_that_was_there_long_before(monkeypatch):
    """Of a camera that has died since it would be the last one, and taken for a new one."""
    now = 100.0
    monkeypatch.setattr(images, "time", SimpleNamespace(time=time.time, monotonic=lambda: now))

    async def first(age, put_again):
        nonlocal now
        source = LatestImage()
        source.put(np.full((24, 16), 50, np.uint8))
        now += age
        receiving = asyncio.ensure_future(webrtc.NewestPictureTrack(source).recv())
        await asyncio.sleep(0)  # it looks
        if put_again:
            assert not receiving.done()
            source.put(np.full((24, 16), 200, np.uint8))
        return (await asyncio.wait_for(receiving, 5.0)).to_ndarray()[0, 0]

    assert asyncio.run(first(webrtc.OLDEST / 2, put_again=False)) == 50
    assert asyncio.run(first(webrtc.OLDEST * 2, put_again=True)) == 200


def test_drawing_the_time_leaves_the_source_as_it_is():
    planes = np.full((360, 320), 90, np.uint8)
    marked = webrtc.with_time(planes, 1_795_300_000.0)
    assert (planes == 90).all()
    assert read_age(marked[:240], 1_795_300_000.5) == pytest.approx(0.5, abs=2e-4)
    assert marked[240:].reshape(2, 120, 160)[:, -1].tolist() == [[128] * 160] * 2
