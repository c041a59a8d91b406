"""Bounds what pictures and sound of the other end may cost, in aiortc's receivers.

A stream says in a few bytes how large its pictures are, and a decoder believes it: 16383x16383 are gigabytes. And what
comes faster than it is decoded waits without end. So pictures beyond `MAX_PIXELS` are not decoded, and a stream that is
`MAX_WAITING` pieces behind goes on with what can be decoded alone. `bound` sets narrower bounds for one receiver.

When a receiver ends, aiortc waits on the event loop for its decoder's thread: what waits then is not decoded any more.
"""

from __future__ import annotations

import logging
import queue
import struct
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import aiortc.rtcrtpreceiver
import av
from aiortc import RTCRtpReceiver
from aiortc.codecs.h264 import H264Decoder
from aiortc.codecs.vpx import Vp8Decoder
from aiortc.jitterbuffer import JitterFrame
from aiortc.rtcrtpparameters import RTCRtpCodecParameters

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


@dataclass
class _BoundedCodec(RTCRtpCodecParameters):
    """Tells the decoder's thread, which knows nothing else of its receiver, how large pictures may be."""

    max_pixels: int = MAX_PIXELS


class BoundedVp8Decoder(Vp8Decoder):
    """Leaves out key frames that are too large, and what follows them until the next one."""

    def __init__(self, max_pixels: int = MAX_PIXELS) -> None:
        super().__init__()
        self._max_pixels = max_pixels
        self._refused = False

    def decode(self, encoded_frame: JitterFrame) -> list[av.frame.Frame]:
        size = vp8_size(encoded_frame.data)
        if size is not None:
            refused = size[0] * size[1] > self._max_pixels
            if refused and not self._refused:
                log.warning("pictures of %d x %d pixels are not decoded: they are too large", *size)
            self._refused = refused
        return [] if self._refused else super().decode(encoded_frame)


class WaitingFrames(queue.Queue):
    """What waits for a decoder: (codec, frame), or None for the end."""

    _skipping = False
    _most, _max_pixels = MAX_WAITING, MAX_PIXELS
    _on_behind: Callable[[], None] | None = None

    def bound(self, max_pixels: int, most: int, behind: Callable[[], None]) -> None:
        """Set bounds of its own; `behind` is called when something is left out because the decoder is behind."""
        self._max_pixels, self._most, self._on_behind = max_pixels, most, behind

    def put(self, item: tuple[Any, JitterFrame] | None, block: bool = True, timeout: float | None = None) -> None:
        if item is None:
            with self.mutex:
                self.queue.clear()  # its end is waited for, and nobody looks at what would come
        elif self._skips(item[0].name, item[1].data):
            if self._on_behind is not None:
                self._on_behind()
            return
        elif self._max_pixels != MAX_PIXELS:
            item = _BoundedCodec(**vars(item[0]), max_pixels=self._max_pixels), item[1]
        super().put(item, block, timeout)

    def _skips(self, codec: str, data: bytes) -> bool:
        if self.qsize() >= self._most:
            self._skipping = True
        elif self._skipping and (codec != "VP8" or vp8_size(data) is not None):
            self._skipping = False
        return self._skipping


def bound(receiver: RTCRtpReceiver, max_pixels: int, most_waiting: int) -> None:
    """Bound a receiver that has not begun to receive; when it is behind, it asks for a picture that stands alone."""
    # Neither has a public name. aiortc asks for such a picture, too, when one could not be decoded.
    waiting: WaitingFrames = receiver._RTCRtpReceiver__decoder_queue  # type: ignore[attr-defined]
    waiting.bound(max_pixels, most_waiting, receiver._RTCRtpReceiver__decoder_error.set)  # type: ignore[attr-defined]


def _bounded_decoder(codec: Any) -> Any:
    decoder, max_pixels = _get_decoder(codec), getattr(codec, "max_pixels", MAX_PIXELS)
    if isinstance(decoder, Vp8Decoder):
        return BoundedVp8Decoder(max_pixels)
    if isinstance(decoder, H264Decoder):
        decoder.codec.options = {"max_pixels": str(max_pixels)}
    return decoder


def bound_receivers() -> None:
    """Let every receiver that is made from now on decode within these bounds."""
    # The names by which aiortc's receivers find them.
    aiortc.rtcrtpreceiver.get_decoder = _bounded_decoder
    aiortc.rtcrtpreceiver.queue = SimpleNamespace(Queue=WaitingFrames)  # type: ignore[assignment]  # all it uses of it
