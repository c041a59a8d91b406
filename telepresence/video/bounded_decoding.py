"""Bounds what pictures and sound of the other end may cost, in aiortc's receivers.

A stream says in a few bytes how large its pictures are, and a decoder believes it: 16383x16383 are gigabytes. And what
comes faster than it is decoded waits without end. So pictures beyond `MAX_PIXELS` are not decoded, and a stream that is
`MAX_WAITING` pieces behind goes on with what can be decoded alone.
"""

from __future__ import annotations

import logging
import queue
import struct
from types import SimpleNamespace
from typing import Any

import aiortc.rtcrtpreceiver
import av
from aiortc.codecs.h264 import H264Decoder
from aiortc.codecs.vpx import Vp8Decoder
from aiortc.jitterbuffer import JitterFrame

from telepresence.video.jpeg_header import MAX_PIXELS

log = logging.getLogger(__name__)

MAX_WAITING = 90
"""Pictures, or pieces of sound, that wait to be decoded: three seconds of pictures."""
_KEY_START = b"\x9d\x01\x2a"
_get_decoder = aiortc.rtcrtpreceiver.get_decoder


def vp8_size(data: bytes) -> tuple[int, int] | None:
    """Return width and height [pixel] that a VP8 frame announces; None for one that is no key frame.

    Source: RFC 6386, 9.1.
    """
    if len(data) < 10 or data[0] & 1 or data[3:6] != _KEY_START:
        return None
    width, height = struct.unpack_from("<HH", data, 6)
    return width & 0x3FFF, height & 0x3FFF


class BoundedVp8Decoder(Vp8Decoder):
    """Leaves out key frames that are too large, and what follows them until the next one."""

    def __init__(self) -> None:
        super().__init__()
        self._refused = False

    def decode(self, encoded_frame: JitterFrame) -> list[av.frame.Frame]:
        size = vp8_size(encoded_frame.data)
        if size is not None:
            refused = size[0] * size[1] > MAX_PIXELS
            if refused and not self._refused:
                log.warning("pictures of %d x %d pixels are not decoded: they are too large", *size)
            self._refused = refused
        return [] if self._refused else super().decode(encoded_frame)


class WaitingFrames(queue.Queue):
    """What waits for a decoder: (codec, frame), or None for the end."""

    _skipping = False

    def put(self, item: tuple[Any, JitterFrame] | None, block: bool = True, timeout: float | None = None) -> None:
        if item is not None and self._skips(item[0].name, item[1].data):
            return
        super().put(item, block, timeout)

    def _skips(self, codec: str, data: bytes) -> bool:
        if self.qsize() >= MAX_WAITING:
            self._skipping = True
        elif self._skipping and (codec != "VP8" or vp8_size(data) is not None):
            self._skipping = False
        return self._skipping


def _bounded_decoder(codec: Any) -> Any:
    decoder = _get_decoder(codec)
    if isinstance(decoder, Vp8Decoder):
        return BoundedVp8Decoder()
    if isinstance(decoder, H264Decoder):
        decoder.codec.options = {"max_pixels": str(MAX_PIXELS)}
    return decoder


def bound_receivers() -> None:
    """Let every receiver that is made from now on decode within these bounds."""
    # The names by which aiortc's receivers find them.
    aiortc.rtcrtpreceiver.get_decoder = _bounded_decoder
    aiortc.rtcrtpreceiver.queue = SimpleNamespace(Queue=WaitingFrames)  # type: ignore[assignment]  # all it uses of it
