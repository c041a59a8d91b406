"""Targets: session descriptions, pictures, streams of pictures, and text that is shown."""

from __future__ import annotations

import asyncio
import functools
import logging
from fractions import Fraction

from fuzz_harness import Target


@functools.cache
def offers() -> tuple[bytes, ...]:
    """Return offers and an answer as aiortc makes them."""
    from aiortc import RTCPeerConnection

    async def make() -> tuple[bytes, ...]:
        video, sound, answering = RTCPeerConnection(), RTCPeerConnection(), RTCPeerConnection()
        video.addTransceiver("video", "recvonly")
        sound.addTransceiver("audio", "sendrecv")
        for peer in (video, sound):
            await peer.setLocalDescription(await peer.createOffer())
        await answering.setRemoteDescription(video.localDescription)
        await answering.setLocalDescription(await answering.createAnswer())
        made = tuple(peer.localDescription.sdp.encode() for peer in (video, sound, answering))
        await asyncio.gather(*(peer.close() for peer in (video, sound, answering)))
        return made

    return asyncio.run(make())


def sdp() -> Target:
    """Offers and answers: what is handed to aiortc, and aiortc's parser, which may raise whatever it likes but must
    end."""
    from aiortc.sdp import SessionDescription

    from telepresence.video.foreign_sdp import checked

    def feed(data: bytes) -> None:
        try:
            text = checked(data.decode(), "10.0.0.2")
        except ValueError:
            return
        candidates = [line.split() for line in text.splitlines() if line.startswith("a=candidate:")]
        assert all(words[4] == "10.0.0.2" for words in candidates), "somebody else would be asked"
        try:
            SessionDescription.parse(text)
        except Exception as error:  # the servers refuse the offer, whatever it is
            logging.debug("%r", error)

    return Target(feed, offers(), longest=12_000)


def sdp_offer() -> Target:
    """Whole offers at the camera's server: a peer connection for each, which is ended again."""
    from aiortc import RTCSessionDescription

    from telepresence.video.foreign_sdp import checked
    from telepresence.video.webrtc import on_address, peer_connection

    loop = asyncio.new_event_loop()

    async def answer(offer: str) -> None:
        peer = peer_connection()
        try:
            with on_address("127.0.0.1"):
                await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
                await peer.setLocalDescription(await peer.createAnswer())
        finally:
            await peer.close()

    def feed(data: bytes) -> None:
        try:
            text = checked(data.decode(), "127.0.0.1")
        except ValueError:
            return
        try:
            loop.run_until_complete(asyncio.wait_for(answer(text), 10.0))
        except TimeoutError as error:
            raise AssertionError("the answer takes 10 s") from error
        except Exception as error:  # the server refuses the offer, whatever it is
            logging.debug("%r", error)

    return Target(feed, offers()[:2], longest=12_000)


def pasted_line() -> Target:
    """Lines that are pasted by hand: offer, answer, candidate, bye."""
    import json

    from telepresence.video.copy_paste_signaling import parse

    seeds = (
        *(json.dumps({"sdp": offer.decode(), "type": "offer"}).encode() for offer in offers()[:1]),
        b'{"candidate": "candidate:0 1 UDP 2122252543 10.0.0.2 40000 typ host", "id": "0", "type": "candidate"}',
        b'{"type": "bye"}',
    )
    return Target(lambda data: parse(data.decode(errors="replace")), seeds, (ValueError,), 8000)


def jpeg() -> Target:
    """Pictures of a robot or a camera: headers first, then OpenCV, never more than is allowed."""
    import numpy as np

    from telepresence.video.jpeg import decode_jpeg, encode_jpeg

    picture = np.random.default_rng(0).integers(0, 255, (16, 24, 3), np.uint8)
    plain = encode_jpeg(picture)
    import cv2

    progressive = cv2.imencode(".jpg", picture, (cv2.IMWRITE_JPEG_PROGRESSIVE, 1))[1].tobytes()
    grey = cv2.imencode(".jpg", picture[:, :, 0])[1].tobytes()

    def feed(data: bytes) -> None:
        pixels = decode_jpeg(data, max_pixels=1 << 16)
        assert pixels.shape[0] * pixels.shape[1] <= 1 << 16

    return Target(feed, (plain, progressive, grey), (ValueError,), 3000)


def jpeg_header() -> Target:
    """Headers of JPEG pictures, without a decoder."""
    from telepresence.video.jpeg_header import check_jpeg

    return Target(check_jpeg, jpeg().seeds, (ValueError,), 3000)


def camera_jpeg() -> Target:
    """Buffers of a web camera that are passed on without being decoded."""
    from telepresence_1.jpeg import completed

    return Target(completed, jpeg().seeds, (ValueError,), 3000)


def tablet_picture() -> Target:
    """JPEG and PNG files that the simulated tablet shows, up to 256x256 pixels here: a large one takes its time."""
    from unittest.mock import patch

    import cv2
    import numpy as np

    from pepper_sim.tablet import screen

    def feed(data: bytes) -> None:
        with patch.object(screen, "MAX_PIXELS", 1 << 16):
            screen.decode(data)

    picture = np.random.default_rng(0).integers(0, 255, (12, 16, 4), np.uint8)
    pngs = [cv2.imencode(".png", part)[1].tobytes() for part in (picture, picture[:, :, :3], picture[:, :, 0])]
    largest = cv2.imencode(".png", np.zeros((256, 256, 4), np.uint8))[1].tobytes()
    return Target(feed, (*pngs, jpeg().seeds[0]), (ValueError,), 3000, largest)


def multipart() -> Target:
    """A stream of pictures in pieces; each reading may be cut anywhere."""
    from pepper_sim.tablet.multipart import MalformedStream, MultipartParser

    def feed(data: bytes) -> None:
        boundary, _, stream = data.partition(b"\n")
        parser = MultipartParser(boundary.decode("latin-1"), 4096)
        step = 1 + len(stream) // 3
        for at in range(0, len(stream), step):
            for body in parser.feed(stream[at : at + step]):
                assert len(body) <= len(stream)

    part = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: 5\r\n\r\nabcde\r\n"
    seeds = (b"frame\n" + part * 3, b"--x\n--x\nContent-Type: a\n\nabc\n--x\n\ndef\n--x\n")
    return Target(feed, seeds, (MalformedStream,))


def shown_text() -> Target:
    """Texts of robots and messages, before they are shown: printable, short, and at most as long as allowed."""
    from telepresence.security.outside_text import LONGEST, clean

    def feed(data: bytes) -> None:
        text = data.decode("utf-8", "surrogateescape")
        shown = clean(text)
        assert len(shown) <= LONGEST and shown.isprintable(), ascii(shown)
        assert all(line.isprintable() for line in clean(text, lines=True).split("\n"))

    return Target(feed, ("way is free; Grüße".encode(), b"two\nlines\t\x1b[2J"), longest=2000)


def vp8_frame() -> Target:
    """Frames of a WebRTC stream: sizes first, then FFmpeg's decoder; damaged frames give no picture."""
    import av
    import numpy as np
    from aiortc.jitterbuffer import JitterFrame

    from telepresence.video.bounded_decoding import MAX_PIXELS, BoundedVp8Decoder, vp8_size

    encoder = av.CodecContext.create("libvpx", "w")
    encoder.width, encoder.height, encoder.pix_fmt, encoder.time_base = 32, 24, "yuv420p", Fraction(1, 30)
    encoder.options = {"deadline": "realtime", "lag-in-frames": "0"}
    frames = []
    for number in range(3):
        pixels = np.random.default_rng(number).integers(0, 255, (24, 32, 3), np.uint8)
        picture = av.VideoFrame.from_ndarray(pixels, "rgb24")
        picture.pts = number
        frames += [bytes(packet) for packet in encoder.encode(picture)]
    decoder = BoundedVp8Decoder()

    def feed(data: bytes) -> None:
        for frame in (frames[0], data):  # a damaged one must not spoil the next key frame
            for picture in decoder.decode(JitterFrame(data=frame, timestamp=0)):
                assert picture.width * picture.height <= MAX_PIXELS
        vp8_size(data)

    return Target(feed, tuple(frames), (av.FFmpegError,), 3000)
