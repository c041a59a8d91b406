"""A microphone, captured in small pieces."""

from __future__ import annotations

from collections.abc import Callable

from telepresence.audio import devices
from telepresence.audio.pipeline import Gst, KeptPipeline

_LEVEL = "level name=level interval=100000000 post-messages=true"


class Microphone:
    """Captures from `start` to `close`, and whenever a device comes back.

    Args:
        device: See `telepresence.audio.devices`.
        rate: Called before every start; returns the sample rate for `on_sound` [Hz].
        on_sound: Gets int16 little-endian, stereo interleaved, some 10 ms at a time, on a thread of GStreamer.
        on_level: Gets the mean level [dBFS] ten times a second.
        via: Called before every start with the chosen device; returns the one to open in its place.
    """

    def __init__(
        self,
        device: str,
        rate: Callable[[], int],
        on_sound: Callable[[bytes], None],
        on_level: Callable[[float], None] = lambda level: None,
        via: Callable[[str], str] = str,
    ) -> None:
        self.device = device
        self._via = via
        self._rate = rate
        self._on_sound = on_sound
        self.pipeline = KeptPipeline("microphone", self._describe, self._prepare, on_level)

    def start(self) -> Microphone:
        self.pipeline.start()
        return self

    def close(self) -> None:
        self.pipeline.close()

    def choose(self, device: str) -> None:
        """Capture from another device."""
        self.device = device
        self.pipeline.reopen()

    def _describe(self) -> str:
        source = devices.source(self._via(self.device))
        return (
            f"{source} ! audioconvert ! {_LEVEL} ! audioresample ! audio/x-raw,format=S16LE,"
            f"rate={self._rate()},channels=2,layout=interleaved ! appsink name=out sync=false max-buffers=50 drop=true"
        )

    def _prepare(self, pipeline: Gst.Pipeline) -> None:
        sink = pipeline.get_by_name("out")
        sink.set_property("emit-signals", True)
        sink.connect("new-sample", self._take)

    def _take(self, sink: Gst.Element) -> Gst.FlowReturn:
        sample = sink.emit("pull-sample")
        if sample is not None:
            buffer = sample.get_buffer()
            self._on_sound(buffer.extract_dup(0, buffer.get_size()))
        return Gst.FlowReturn.OK
