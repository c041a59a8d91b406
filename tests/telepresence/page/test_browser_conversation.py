"""Sound and face of one connection: a WebRTC client says and shows what it likes, and only the driver gets through."""

from __future__ import annotations

import asyncio
import fractions
from types import SimpleNamespace

import av
import numpy as np
import pytest
from aiortc import MediaStreamTrack, RTCPeerConnection, RTCSessionDescription

from telepresence.audio.webrtc_sound import RATE, SAMPLES, listen
from telepresence.page.browser_conversation import RobotConversation
from telepresence.page.browser_face import MAX_PIXELS
from telepresence.video.jpeg import decode_jpeg
from telepresence.video.webrtc import on_address

GREEN = (40, 180, 60)


class Station:
    def __init__(self):
        self.said, self.faces = [], []
        self.take = None

    def listen(self, take):
        self.take = take

    def speak(self, frames, rate, channels):
        self.said.append((frames, rate, channels))

    def show_face(self, jpeg):
        self.faces.append(jpeg)

    def state(self):
        return {"speak": True}


class Tone(MediaStreamTrack):
    kind = "audio"
    count = 0

    async def recv(self):
        await asyncio.sleep(0.02)
        at = (self.count * SAMPLES + np.arange(SAMPLES)) / RATE
        samples = (8000 * np.sin(2 * np.pi * 600 * at)).astype("<i2")
        frame = av.AudioFrame.from_ndarray(samples.reshape(1, -1), format="s16", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = RATE, self.count * SAMPLES, fractions.Fraction(1, RATE)
        self.count += 1
        return frame


class Camera(MediaStreamTrack):
    kind = "video"
    count = 0
    shape = (480, 640)

    async def recv(self):
        await asyncio.sleep(0.05)
        frame = av.VideoFrame.from_ndarray(np.full((*self.shape, 3), GREEN, np.uint8), format="rgb24")
        self.count += 1
        frame.pts, frame.time_base = self.count * 4500, fractions.Fraction(1, 90000)
        return frame.reformat(format="yuv420p")


class Connected:
    """A page of nobody's that speaks and films from the start, and the station's end."""

    def __init__(self):
        self.station, self.window = Station(), SimpleNamespace(mine=False)
        self.part = RobotConversation(self.station).browser(self.window)
        self.browser, self.peer = RTCPeerConnection(), RTCPeerConnection()

    async def __aenter__(self):
        with on_address("127.0.0.1"):
            self.browser.addTransceiver(Camera(), direction="sendrecv")  # which nobody asked for
            self.browser.addTrack(Tone())
            self.browser.addTransceiver(Camera(), direction="sendonly")
            await self.browser.setLocalDescription(await self.browser.createOffer())
            await self.peer.setRemoteDescription(RTCSessionDescription(self.browser.localDescription.sdp, "offer"))
            self.part.join(self.peer)
            await self.peer.setLocalDescription(await self.peer.createAnswer())
            await self.browser.setRemoteDescription(RTCSessionDescription(self.peer.localDescription.sdp, "answer"))
        self.part.check()
        await self.until(lambda: self.peer.connectionState == "connected")
        return self

    async def __aexit__(self, *_):
        self.part.close()
        await asyncio.gather(self.browser.close(), self.peer.close())

    async def until(self, condition):
        async with asyncio.timeout(20):
            while not condition():
                await asyncio.sleep(0.05)
                self.part.check()

    async def sent(self, kind):
        """Packets of a kind that the client has sent so far."""
        reports = (await self.browser.getStats()).values()
        return sum(each.packetsSent for each in reports if each.type == "outbound-rtp" and each.kind == kind)


def run(scenario):
    async def connected():
        async with Connected() as on:
            await scenario(on)

    asyncio.run(connected())


def test_who_has_not_the_robot_is_neither_heard_nor_seen_whatever_it_sends():
    async def scenario(on):
        on.part.ask("face", True)
        while await on.sent("audio") < 20 or await on.sent("video") < 5:
            await asyncio.sleep(0.05)
            on.part.check()
        assert on.station.said == [] and on.station.faces == []
        assert all(each.receiver.track._queue.empty() for each in on.peer.getTransceivers()), "nothing piles up"
        assert on.part.describe() == {"speak": True, "listens": False, "speaks": False, "shows": False, "seen": False}

    run(scenario)


def test_the_driver_is_heard_and_seen_until_the_robot_is_another_s():
    async def scenario(on):
        on.window.mine = True
        on.part.ask("face", True)
        await on.until(lambda: len(on.station.said) > 25 and any(on.station.faces))
        frames, rate, channels = on.station.said[-1]
        assert (rate, channels, len(frames)) == (RATE, 1, 2 * SAMPLES)
        heard = np.frombuffer(b"".join(piece for piece, *_ in on.station.said[-20:]), "<i2")
        assert np.argmax(np.abs(np.fft.rfft(heard, RATE))) == pytest.approx(600, abs=5)
        picture = decode_jpeg(next(face for face in on.station.faces if face))
        assert picture.shape == (480, 640, 3)
        assert np.abs(picture[240, 320, ::-1].astype(int) - GREEN).max() < 12
        assert on.part.describe()["speaks"] and on.part.describe()["seen"]
        on.window.mine = False
        await on.until(lambda: on.station.faces[-1] is None)
        said = len(on.station.said)
        await asyncio.sleep(0.3)  # in which nothing more may be said
        assert len(on.station.said) == said and on.station.faces.count(None) == 1

    run(scenario)


def test_a_face_larger_than_cameras_have_it_is_not_decoded(monkeypatch, caplog):
    """Each such picture takes a core for a while, and the end of the connection waits for it."""
    monkeypatch.setattr(Camera, "shape", (1200, 1600))
    assert 1200 * 1600 > MAX_PIXELS

    async def scenario(on):
        on.window.mine = True
        on.part.ask("face", True)
        await on.until(lambda: "too large" in caplog.text)
        assert not any(on.station.faces)
        Camera.shape = (720, 1280)
        await on.until(lambda: any(on.station.faces))

    run(scenario)


def test_who_gets_the_robot_back_is_not_shown_before_asking_again(monkeypatch):
    """A page switches its camera off when it loses the robot, and can say so only while it has it."""
    monkeypatch.setattr("telepresence.page.browser_face.PAUSED", 0.2)

    async def scenario(on):
        on.window.mine = True
        on.part.ask("face", True)
        await on.until(lambda: any(on.station.faces))
        on.window.mine = False
        await on.until(lambda: on.station.faces[-1] is None)
        on.browser.getSenders()[-1].replaceTrack(None)
        shown = len(on.station.faces)
        on.window.mine = True
        until = asyncio.get_running_loop().time() + 1.0
        await on.until(lambda: asyncio.get_running_loop().time() > until)
        assert on.station.faces[shown:] == [] and not on.part.describe()["shows"]
        on.part.ask("face", True)
        await on.until(lambda: on.station.faces[shown:])

    run(scenario)


def test_a_camera_without_pictures_is_covered(monkeypatch):
    monkeypatch.setattr("telepresence.page.browser_face.PAUSED", 0.2)

    async def scenario(on):
        on.window.mine = True
        on.browser.getSenders()[-1].replaceTrack(None)
        on.part.ask("face", True)
        await on.until(lambda: b"" in on.station.faces)
        on.part.ask("face", False)
        assert on.station.faces[-1] is None

    run(scenario)


def test_the_robot_is_heard_by_who_asks_for_it():
    async def scenario(on):
        heard = []
        place = next(each for each in on.browser.getTransceivers() if each.kind == "audio")
        listening = asyncio.ensure_future(listen(place.receiver.track, heard.append))
        assert on.station.take is None
        on.part.ask("listen", True)
        at = np.arange(int(0.085 * RATE)) / RATE
        block = (8000 * np.sin(2 * np.pi * 440 * at)).astype("<i2").tobytes()
        for _ in range(8):
            on.station.take(block, RATE, 1)
            await asyncio.sleep(0.085)
        await on.until(lambda: len(heard) > 10)
        samples = np.frombuffer(b"".join(heard), "<i2")[::2]
        assert np.argmax(np.abs(np.fft.rfft(samples, RATE))) == pytest.approx(440, abs=15)
        listening.cancel()
        on.part.close()
        assert on.station.take is None

    run(scenario)
