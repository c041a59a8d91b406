"""The base of everything that plays sound: a chosen loudspeaker, mute, another device on request."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Self

from telepresence.audio import devices
from telepresence.audio.pipeline import Gst, KeptPipeline


class Output:
    """Plays from `start` to `close`, and whenever a device comes back.

    Args:
        name: Appears in messages.
        device: See `telepresence.audio.devices`.
        head: The part of the pipeline before the loudspeaker (gst-launch syntax).
        patience: Seconds of delay accepted on top, for a busy machine or a poor network.
        prepare, on_level, on_state: See `KeptPipeline`.
        via: See `Microphone`.
    """

    def __init__(
        self,
        name: str,
        device: str,
        head: str,
        patience: float = 0.0,
        prepare: Callable[[Gst.Pipeline], None] = lambda pipeline: None,
        on_level: Callable[[float], None] = lambda level: None,
        on_state: Callable[[str | None], None] = lambda problem: None,
        via: Callable[[str], str] = str,
    ) -> None:
        self.device = device
        self._via = via
        self._head = head
        self._patience = patience
        self._prepare_head = prepare
        self._muted = False
        self._volume: Gst.Element | None = None  # of the newest pipeline, which may not run yet
        self._muting = threading.Lock()
        self.pipeline = KeptPipeline(name, self._describe, self._prepare, on_level, on_state)

    def start(self) -> Self:
        self.pipeline.start()
        return self

    def close(self) -> None:
        self.pipeline.close()

    @property
    def muted(self) -> bool:
        return self._muted

    @muted.setter
    def muted(self, muted: bool) -> None:
        with self._muting:
            self._muted = muted
            if self._volume is not None:
                self._volume.set_property("mute", muted)

    def choose(self, device: str) -> None:
        """Play on another device."""
        self.device = device
        self.pipeline.reopen()

    def _describe(self) -> str:
        return f"{self._head} ! volume name=volume ! {devices.sink(self._via(self.device), self._patience)}"

    def _prepare(self, pipeline: Gst.Pipeline) -> None:
        self._prepare_head(pipeline)
        with self._muting:
            self._volume = pipeline.get_by_name("volume")
            self._volume.set_property("mute", self._muted)
