"""What the other end's pictures may cost."""

from __future__ import annotations

import fractions
import struct
from types import SimpleNamespace

import aiortc.rtcrtpreceiver
import av
import numpy as np
import pytest
from aiortc.jitterbuffer import JitterFrame
from aiortc.rtcrtpparameters import RTCRtpCodecParameters

from telepresence.video.bounded_decoding import MAX_WAITING, BoundedVp8Decoder, WaitingFrames, bound_receivers, vp8_size


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
    waiting.put(None)
    assert [waiting.get() for _ in range(3)] == [key, between, None]
