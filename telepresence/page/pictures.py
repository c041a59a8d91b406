"""One robot's pictures for everybody who looks, each form of them made once."""

from __future__ import annotations

from collections.abc import Callable

from telepresence.page.shared_jpeg import SharedJpeg
from telepresence.page.shared_video import SharedVideo
from telepresence.video.images import LatestImage

SMALL_BIT_RATE, SMALL_RATE = 350_000, 10.0
"""[bits/s, pictures/s] of what a bad network gets; an hour is 0.16 GB."""


class Pictures:
    """All forms of a robot's pictures. Belongs to one event loop.

    Args:
        source: Pictures as `telepresence.video.webrtc.planes_of` makes them, stamped with the time they were taken; it
            forgets them when nobody looks any more.
        watch: Told whether anybody looks.
    """

    def __init__(self, source: LatestImage, watch: Callable[[bool], None]) -> None:
        self._source, self._watch, self._looking = source, watch, 0
        self.video = SharedVideo(source, self._count)
        """The stream for WebRTC."""
        self.small = SharedVideo(source, self._count, SMALL_BIT_RATE, shrink=2, rate=SMALL_RATE)
        """The same for networks that do not carry that: half as wide and high."""
        self.jpeg = SharedJpeg(source, self._count)
        """The pictures for a websocket."""

    def _count(self, comes: bool) -> None:
        before, self._looking = self._looking, self._looking + (1 if comes else -1)
        if bool(before) == bool(self._looking):
            return
        self._watch(comes)
        if not comes:
            self._source.forget()  # whoever comes next would see it
