"""The newest picture as a JPEG file, made once for all browsers that get their pictures by a websocket."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np

from telepresence.page.shared_video import OLDEST
from telepresence.video.images import LatestImage, Picture
from telepresence.video.jpeg import encode_jpeg

QUALITY = 60
"""OpenCV's scale, 0 to 100: 640x480 has some 25 kB."""


class SharedJpeg:
    """Encodes pictures that somebody waits for. All of it belongs to one event loop.

    Args:
        source: Pictures as `telepresence.video.webrtc.planes_of` makes them.
        watch: Called with True by each viewer that comes, with False when it goes.
    """

    def __init__(self, source: LatestImage, watch: Callable[[bool], None]) -> None:
        self._source, self._watch = source, watch
        self._newest: Picture | None = None
        self._encoding = asyncio.Lock()

    @contextlib.asynccontextmanager
    async def viewer(self):
        """Yield a function that returns the newest picture, a JPEG file, once there is another one than last time; one
        from before counts if it may still be driven by."""
        loop, news, sequence = asyncio.get_running_loop(), asyncio.Event(), self._source.begin(OLDEST)

        def notify() -> None:  # on the source's thread
            with contextlib.suppress(RuntimeError):  # the loop may have ended since
                loop.call_soon_threadsafe(news.set)

        async def newer() -> Picture:
            nonlocal sequence
            while (picture := self._source.peek()) is None or picture.sequence == sequence:
                news.clear()
                await news.wait()
            picture = await self._encoded()
            sequence = picture.sequence
            return picture

        self._watch(True)
        self._source.add_listener(notify)
        try:
            yield newer
        finally:
            self._source.remove_listener(notify)
            self._watch(False)

    async def _encoded(self) -> Picture:
        async with self._encoding:
            picture = self._source.peek()
            assert picture is not None, "nobody asks before there is one"
            if self._newest is None or self._newest.sequence != picture.sequence:
                file = await asyncio.to_thread(_jpeg_of, picture.content)
                self._newest = replace(picture, content=file)
            return self._newest


def _jpeg_of(planes: np.ndarray) -> bytes:
    return encode_jpeg(cv2.cvtColor(planes, cv2.COLOR_YUV2BGR_I420), QUALITY, "bgr")
