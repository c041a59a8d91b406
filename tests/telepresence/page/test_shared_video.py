"""One encoder for all viewers: real pictures, encoded and decoded."""

import asyncio
import time

import av
import numpy as np
import pytest

from telepresence.page import shared_video
from telepresence.page.shared_video import MOST_WAITING, SharedVideo
from telepresence.video.images import LatestImage


def planes(level, width=160, height=120):
    return np.full((height * 3 // 2, width), level, np.uint8)


class Studio:
    def __init__(self):
        self.source = LatestImage()
        self.watched = []
        self.video = SharedVideo(self.source, self.watched.append)
        self.level = 0

    async def show(self, track=None):
        """A new picture; what the viewer gets of it."""
        self.level = (self.level + 7) % 200
        self.source.put(planes(self.level))
        return await asyncio.wait_for(track.recv(), 5.0) if track else await asyncio.sleep(0.05)


def luma(decoder, packet):
    return [frame.to_ndarray()[0, 0] for frame in decoder.decode(packet)]


def test_every_viewer_gets_the_pictures_of_one_encoder(monkeypatch):
    encoders = []
    open_encoder = SharedVideo._open
    monkeypatch.setattr(SharedVideo, "_open", lambda *size: encoders.append(size) or open_encoder(*size))

    async def run():
        studio = Studio()
        viewers = [studio.video.track() for _ in range(3)]
        decoders = [av.CodecContext.create("vp8", "r") for _ in viewers]
        assert studio.watched == [True] and studio.video.viewers == 3
        for _ in range(5):
            first = await studio.show(viewers[0])
            packets = [first, *[await viewer.recv() for viewer in viewers[1:]]]
            assert len({id(packet) for packet in packets}) == 1
            for decoder in decoders:
                assert abs(int(luma(decoder, first)[0]) - studio.level) <= 4
        for viewer in viewers:
            viewer.stop()
        assert studio.watched == [True, False] and studio.video.viewers == 0

    asyncio.run(run())
    assert len(encoders) == 1


def test_whoever_comes_later_begins_with_a_key_picture(monkeypatch):
    monkeypatch.setattr(shared_video, "KEY_PERIOD", 0.0)

    async def run():
        studio = Studio()
        first = studio.video.track()
        await studio.show(first)
        assert not (await studio.show(first)).is_keyframe
        late = studio.video.track()
        packet = await studio.show(late)
        assert packet.is_keyframe and luma(av.CodecContext.create("vp8", "r"), packet)

    asyncio.run(run())


def test_a_slow_viewer_gets_newer_pictures_instead_of_all(monkeypatch):
    monkeypatch.setattr(shared_video, "KEY_PERIOD", 0.0)

    async def run():
        studio = Studio()
        quick, slow = studio.video.track(), studio.video.track()
        for _ in range(MOST_WAITING + 1):
            await studio.show(quick)
        await studio.show(quick)
        await studio.show(quick)
        packet = await asyncio.wait_for(slow.recv(), 5.0)
        assert packet.is_keyframe, "what it can begin with"
        assert abs(int(luma(av.CodecContext.create("vp8", "r"), packet)[0]) - studio.level) <= 14, "and a new one"

    asyncio.run(run())


def test_requests_for_key_pictures_have_a_limit():
    async def run():
        studio = Studio()
        viewer = studio.video.track()
        keys, began = 0, time.monotonic()
        for _ in range(10):
            studio.video.ask_for_key_picture()
            keys += (await studio.show(viewer)).is_keyframe
        took = time.monotonic() - began  # on a busy machine the ten may take longer than the limit
        assert 1 <= keys <= 1 + took / shared_video.KEY_PERIOD

    asyncio.run(run())


def test_another_size_is_encoded_anew():
    async def run():
        studio = Studio()
        viewer = studio.video.track()
        await studio.show(viewer)
        studio.source.put(planes(50, 320, 240))
        packet = await asyncio.wait_for(viewer.recv(), 5.0)
        assert packet.is_keyframe
        frame = av.CodecContext.create("vp8", "r").decode(packet)[0]
        assert (frame.width, frame.height) == (320, 240)

    asyncio.run(run())


def test_a_viewer_that_ends_waits_for_nothing():
    async def run():
        studio = Studio()
        viewer = studio.video.track()
        waiting = asyncio.ensure_future(viewer.recv())
        await asyncio.sleep(0)
        viewer.stop()
        with pytest.raises(shared_video.MediaStreamError):
            await asyncio.wait_for(waiting, 5.0)

    asyncio.run(run())


@pytest.mark.parametrize("shape", [(3, 2), (3 * 8200, 2), (5, 3)], ids=["too small", "too high", "no planes"])
def test_a_picture_that_cannot_be_encoded_is_left_out(shape, caplog):
    async def run():
        source = LatestImage()
        video = SharedVideo(source, lambda _: None, shrink=2)
        viewer = video.track()
        source.put(np.zeros(shape, np.uint8))
        async with asyncio.timeout(5.0):
            while not caplog.records:
                await asyncio.sleep(0.001)
        source.put(np.zeros(shape, np.uint8))
        await asyncio.sleep(0.02)
        source.put(planes(100))
        assert (await asyncio.wait_for(viewer.recv(), 5.0)).is_keyframe
        viewer.stop()

    asyncio.run(run())
    assert len(caplog.records) == 1 and "left out" in caplog.text
