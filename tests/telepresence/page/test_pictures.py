"""Whoever comes to look sees what the camera sees, not what it has seen: in each form of the pictures."""

import asyncio
import time

import av
import cv2
import numpy as np
import pytest

from telepresence.page.pictures import Pictures
from telepresence.video.images import LatestImage

FORMS = ["video", "small", "jpeg"]
OLD, NEW = 60, 180
"""Brightness."""


class Studio:
    def __init__(self):
        self.source, self.watched = LatestImage(), []
        self.pictures = Pictures(self.source, self.watched.append)

    def show(self, level, age=0.0):
        planes = np.full((180, 160), 128, np.uint8)
        planes[:120] = level
        self.source.put(planes, time.time() - age)

    async def first(self, form, then=None):
        """The brightness of the first picture of somebody who comes; `then` is called when nothing has come at once."""
        if form == "jpeg":
            async with self.pictures.jpeg.viewer() as newer:
                file = (await self.awaited(newer(), then)).content
                return cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_GRAYSCALE)[5, 5]
        track = getattr(self.pictures, form).track()
        try:
            packet = await self.awaited(track.recv(), then)
            assert packet.is_keyframe
            return av.CodecContext.create("vp8", "r").decode(packet)[0].to_ndarray()[0, 0]
        finally:
            track.stop()

    async def awaited(self, picture, then):
        coming = asyncio.ensure_future(picture)
        if then is not None:
            await asyncio.sleep(0.3)  # in which an old one would be encoded
            assert not coming.done()
            then()
        return await asyncio.wait_for(coming, 10.0)


def is_new(level):
    return abs(int(level) - NEW) < 30


@pytest.mark.parametrize("form", FORMS)
def test_an_old_picture_is_shown_to_nobody_who_comes(form):
    async def run():
        studio = Studio()
        studio.show(OLD, age=3600.0)
        assert is_new(await studio.first(form, lambda: studio.show(NEW)))

    asyncio.run(run())


@pytest.mark.parametrize("form", FORMS)
def test_a_picture_of_just_now_is_shown_at_once(form):
    async def run():
        studio = Studio()
        studio.show(NEW)
        assert is_new(await studio.first(form))

    asyncio.run(run())


@pytest.mark.parametrize("form", FORMS)
def test_what_the_last_one_saw_is_forgotten(form):
    """Somebody has just looked, and the camera dies."""

    async def run():
        studio = Studio()
        studio.show(OLD)
        await studio.first(form)
        assert studio.watched == [True, False] and studio.source.peek() is None
        assert is_new(await studio.first(form, lambda: studio.show(NEW)))

    asyncio.run(run())
