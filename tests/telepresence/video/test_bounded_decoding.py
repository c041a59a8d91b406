"""What the other end's pictures may cost."""

from __future__ import annotations

import asyncio
import fractions
import struct
import time
from collections.abc import Coroutine
from types import SimpleNamespace
from typing import Any

import aiortc.rtcrtpreceiver
import av
import numpy as np
import pytest
from aiortc import MediaStreamTrack, RTCCertificate, RTCDtlsTransport, RTCRtpReceiver
from aiortc.jitterbuffer import JitterFrame
from aiortc.rtcrtpparameters import RTCRtpCodecParameters

from telepresence.video.bounded_decoding import (
    MAX_WAITING,
    BoundedVp8Decoder,
    WaitingFrames,
    bound,
    bound_receivers,
    vp8_size,
)
from telepresence.video.webrtc import drain, on_address, peer_connection

BACKLOG = 40
"""Pictures that wait while somebody hangs up."""


def encode(name: str = "libvpx", width: int = 64, height: int = 48) -> bytes:
    """A key frame."""
    encoder = av.CodecContext.create(name, "w")
    encoder.width, encoder.height, encoder.pix_fmt = width, height, "yuv420p"
    encoder.time_base = fractions.Fraction(1, 30)
    frame = av.VideoFrame.from_ndarray(np.zeros((height * 3 // 2, width), np.uint8), format="yuv420p")
    frame.pts = 0
    return b"".join(bytes(packet) for packet in [*encoder.encode(frame), *encoder.encode(None)])


def resized(frame: bytes, width: int, height: int) -> bytes:
    return frame[:6] + struct.pack("<HH", width, height) + frame[10:]


def test_a_frame_says_how_large_it_is() -> None:
    frame = encode()
    assert vp8_size(frame) == (64, 48)
    assert vp8_size(resized(frame, 0xC000 + 16383, 16383)) == (16383, 16383), "two bits are for scaling"
    assert vp8_size(bytes([frame[0] | 1]) + frame[1:]) is None and vp8_size(b"") is None and vp8_size(frame[:9]) is None


def test_too_large_pictures_are_not_decoded_and_small_ones_are_again(caplog: pytest.LogCaptureFixture) -> None:
    decoder, frame = BoundedVp8Decoder(), encode()
    follows = JitterFrame(bytes([frame[0] | 1]) + frame[1:], 0)
    assert [each.width for each in decoder.decode(JitterFrame(frame, 0))] == [64]
    for _ in range(3):
        assert decoder.decode(JitterFrame(resized(frame, 16383, 16383), 1)) == []
        assert decoder.decode(follows) == []
    assert len(caplog.messages) == 1
    assert [each.width for each in decoder.decode(JitterFrame(frame, 2))] == [64]


def test_receivers_use_it_and_h264_is_bounded_too() -> None:
    bound_receivers()
    made = {
        name: aiortc.rtcrtpreceiver.get_decoder(RTCRtpCodecParameters(f"video/{name}", 90000, payloadType=97))
        for name in ("VP8", "H264")
    }
    assert isinstance(made["VP8"], BoundedVp8Decoder)
    small, large = (encode("libx264", *size) for size in ((64, 48), (4096, 4096)))
    assert len(made["H264"].decode(JitterFrame(small, 0)) + made["H264"].codec.decode(None)) == 1
    other = aiortc.rtcrtpreceiver.get_decoder(RTCRtpCodecParameters("video/H264", 90000, payloadType=97))
    with pytest.raises(av.FFmpegError):
        other.decode(JitterFrame(large, 0))
        other.codec.decode(None)


def test_a_decoder_that_is_behind_goes_on_with_what_stands_alone() -> None:
    waiting, frame = WaitingFrames(), encode()
    codec = SimpleNamespace(name="VP8")
    key, between = (codec, JitterFrame(frame, 0)), (codec, JitterFrame(bytes([frame[0] | 1]) + frame[1:], 0))
    for _ in range(10 * MAX_WAITING):
        waiting.put(between)
    assert waiting.qsize() == MAX_WAITING
    while not waiting.empty():
        waiting.get()
    waiting.put(between)
    assert waiting.empty(), "it is a change of what was left out"
    waiting.put(key)
    waiting.put(between)
    assert [waiting.get() for _ in range(2)] == [key, between]


def test_a_decoder_with_a_bound_of_its_own_asks_for_what_stands_alone() -> None:
    receiver = RTCRtpReceiver(
        "video", RTCDtlsTransport(SimpleNamespace(state="new"), [RTCCertificate.generateCertificate()])
    )
    bound(receiver, 64 * 48, 2)
    waiting, asked = receiver._RTCRtpReceiver__decoder_queue, receiver._RTCRtpReceiver__decoder_error
    codec = RTCRtpCodecParameters("video/VP8", 90000, payloadType=97)
    for number in range(3):
        assert not asked.is_set()
        waiting.put((codec, JitterFrame(encode(), number)))
    assert asked.is_set() and waiting.qsize() == 2
    decoder = aiortc.rtcrtpreceiver.get_decoder(waiting.get()[0])
    assert decoder.decode(JitterFrame(encode(), 0)) and not decoder.decode(JitterFrame(encode(width=80), 0))


def test_a_connection_that_ends_does_not_wait_for_what_was_not_decoded() -> None:
    """aiortc waits for the decoder on the event loop, and everybody's commands wait with it."""
    large = encode(width=4096, height=2048)
    asyncio.run(hang_up(large))


async def hang_up(picture: bytes) -> None:
    sender, receiver = peer_connection(), peer_connection()
    with on_address("127.0.0.1"):
        sender.addTrack(Endless(picture))
        await sender.setLocalDescription(await sender.createOffer())
        await receiver.setRemoteDescription(sender.localDescription)
        await receiver.setLocalDescription(await receiver.createAnswer())
        await sender.setRemoteDescription(receiver.localDescription)
    track = receiver.getReceivers()[0].track
    taking = asyncio.ensure_future(drain(track, lambda _: None))
    waiting = receiver.getReceivers()[0]._RTCRtpReceiver__decoder_queue
    async with asyncio.timeout(60.0):
        while waiting.qsize() < BACKLOG:
            await asyncio.sleep(0.02)
    decoder, began = BoundedVp8Decoder(), time.monotonic()
    for number in range(5):
        decoder.decode(JitterFrame(picture, number))
    backlog = BACKLOG * (time.monotonic() - began) / 5
    stood_still = await longest_turn(receiver.close())
    assert stood_still < backlog / 4
    await asyncio.gather(sender.close(), taking)


class Endless(MediaStreamTrack):
    """The same picture again and again, faster than it is decoded."""

    kind = "video"

    def __init__(self, picture: bytes) -> None:
        super().__init__()
        self._picture, self._count = picture, 0

    async def recv(self) -> av.Packet:
        await asyncio.sleep(0.005)
        self._count += 1
        packet = av.Packet(self._picture)
        packet.pts, packet.time_base = self._count * 1800, fractions.Fraction(1, 90000)
        return packet


async def longest_turn(work: Coroutine[Any, Any, None]) -> float:
    """Return for how long the event loop stood still at most until something was done [s]."""
    doing, longest = asyncio.ensure_future(work), 0.0
    while not doing.done():
        before = time.monotonic()
        await asyncio.sleep(0)
        longest = max(longest, time.monotonic() - before)
    return longest
