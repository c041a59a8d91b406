"""A loudspeaker that plays what arrives, piece by piece."""

from __future__ import annotations

from collections.abc import Callable

from telepresence.audio import devices
from telepresence.audio.pipeline import Gst, KeptPipeline

_LEVEL = "level name=level interval=100000000 post-messages=true"


class Loudspeaker:
    """Plays from `start` to `close`, and whenever a device comes back.

    Args:
        device: See `telepresence.audio.devices`.
        rate: Of what is pushed [Hz].
        patience: Seconds that a piece may be late without a gap.
        on_level: Gets the mean level [dBFS] ten times a second while something is pushed, muted or not.
    """

    def __init__(
        self,
        device: str,
        rate: int = 48000,
        patience: float = 0.03,
        on_level: Callable[[float], None] = lambda level: None,
    ) -> None:
        self.device = device
        self._muted = False
        self._head = (
            f"appsrc name=in is-live=true format=time do-timestamp=true min-latency={int(patience * 1e9)} "
            "max-bytes=38400 leaky-type=downstream "
            f"caps=audio/x-raw,format=S16LE,rate={rate},channels=2,layout=interleaved ! {_LEVEL} "
            "! audioconvert ! audioresample ! volume name=volume"
        )
        self.pipeline = KeptPipeline("loudspeaker", self._describe, self._prepare, on_level)

    def start(self) -> Loudspeaker:
        self.pipeline.start()
        return self

    def close(self) -> None:
        self.pipeline.close()

    @property
    def muted(self) -> bool:
        return self._muted

    @muted.setter
    def muted(self, muted: bool) -> None:
        self._muted = muted
        self.pipeline.set("volume", "mute", muted)

    def choose(self, device: str) -> None:
        """Play on another device."""
        self.device = device
        self.pipeline.reopen()

    def push(self, frames: bytes) -> None:
        """Play int16 little-endian, stereo interleaved, after what is queued; dropped while there is no device."""
        source = self.pipeline.get("in")
        if source is not None:
            source.emit("push-buffer", Gst.Buffer.new_wrapped(frames))

    def _describe(self) -> str:
        return f"{self._head} ! {devices.sink(self.device)}"

    def _prepare(self, pipeline: Gst.Pipeline) -> None:
        pipeline.get_by_name("volume").set_property("mute", self._muted)
