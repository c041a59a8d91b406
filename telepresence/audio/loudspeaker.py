"""A loudspeaker that plays what arrives, piece by piece."""

from __future__ import annotations

from collections.abc import Callable

from telepresence.audio.output import Output
from telepresence.audio.pipeline import Gst
from telepresence.audio.schedule import Schedule

MOST = 0.08
"""Seconds beyond its lead that a piece may wait before it is played."""
_LEVEL = "level name=level interval=100000000 post-messages=true"


class Loudspeaker(Output):
    """An `Output` that plays what is pushed.

    Args:
        device: See `telepresence.audio.devices`.
        rate: Of what is pushed [Hz].
        lead: Seconds that a piece may be late without a gap.
        patience: Seconds of delay accepted on top, for a busy machine or a poor network.
        name: Appears in messages.
        via: See `Microphone`.
        on_level: Gets the mean level [dBFS] ten times a second while something is pushed, muted or not.
    """

    def __init__(
        self,
        device: str,
        rate: int = 48000,
        lead: float = 0.05,
        patience: float = 0.0,
        on_level: Callable[[float], None] = lambda level: None,
        name: str = "loudspeaker",
        via: Callable[[str], str] = str,
    ) -> None:
        self._rate = rate
        self._schedule = Schedule(lead + patience, lead + patience + MOST)
        head = (
            "appsrc name=in is-live=true format=time max-bytes=0 leaky-type=downstream "
            f"caps=audio/x-raw,format=S16LE,rate={rate},channels=2,layout=interleaved ! {_LEVEL} "
            "! audioconvert ! audioresample"
        )
        super().__init__(name, device, head, patience, self._forget, on_level, via=via)

    def push(self, frames: bytes) -> None:
        """Play int16 little-endian, stereo interleaved, after what is queued; from any one thread. Dropped while there
        is no device, or when more would wait than is good for a conversation."""
        source = self.pipeline.get("in")
        if source is None:
            return
        # The device's own clock: a device that follows another one's is slow to find it, and plays garbage meanwhile.
        clock = source.get_clock()
        if clock is None:
            return
        now = clock.get_time() - source.get_base_time()
        due, seam = self._schedule.place(now / Gst.SECOND, len(frames) / (4 * self._rate))
        if due is None or due < 0.0:
            return
        buffer = Gst.Buffer.new_wrapped(frames)
        buffer.pts = int(due * Gst.SECOND)
        if seam:
            buffer.set_flags(Gst.BufferFlags.DISCONT)
        source.emit("push-buffer", buffer)

    def _forget(self, _pipeline: Gst.Pipeline) -> None:
        self._schedule.forget()
