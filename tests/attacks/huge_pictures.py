"""A robot whose pictures say that they are huge, and a pilot who looks at them; prints what that cost the pilot [MB].

python huge_pictures.py SECONDS
"""

from __future__ import annotations

import asyncio
import fractions
import resource
import struct
import sys
import threading
import time

import av
import numpy as np
from aiohttp import web
from aiortc import RTCPeerConnection, RTCSessionDescription, VideoStreamTrack
from rto_node.webrtc_camera import WebrtcCamera

from telepresence.video.webrtc import on_address

SIDE = 16383
"""Pixels; what VP8 can say."""


def huge_picture() -> bytes:
    encoder = av.CodecContext.create("libvpx", "w")
    encoder.width = encoder.height = 64
    encoder.pix_fmt, encoder.time_base = "yuv420p", fractions.Fraction(1, 30)
    frame = av.VideoFrame.from_ndarray(np.zeros((96, 64), np.uint8), format="yuv420p")
    frame.pts = 0
    data = b"".join(bytes(packet) for packet in [*encoder.encode(frame), *encoder.encode(None)])
    return data[:6] + struct.pack("<HH", SIDE, SIDE) + data[10:] + bytes(20_000)


class HugePictures(VideoStreamTrack):
    def __init__(self) -> None:
        super().__init__()
        self._data = huge_picture()

    async def recv(self) -> av.Packet:
        packet = av.Packet(self._data)
        packet.pts, packet.time_base = await self.next_timestamp()
        return packet


async def robot(listening: threading.Event, port: list[int]) -> None:
    peers = []

    async def answer(request: web.Request) -> web.Response:
        peers.append(peer := RTCPeerConnection())
        with on_address("127.0.0.1"):
            await peer.setRemoteDescription(RTCSessionDescription(await request.text(), "offer"))
            peer.addTrack(HugePictures())
            await peer.setLocalDescription(await peer.createAnswer())
        return web.Response(status=201, text=peer.localDescription.sdp, content_type="application/sdp")

    application = web.Application()
    application.add_routes([web.post("/camera", answer)])
    runner = web.AppRunner(application)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    port.append(runner.addresses[0][1])
    listening.set()
    await asyncio.Event().wait()


def main() -> None:
    listening, port = threading.Event(), []
    threading.Thread(target=lambda: asyncio.run(robot(listening, port)), daemon=True).start()
    listening.wait(10.0)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    camera = WebrtcCamera(f"127.0.0.1:{port[0]}")
    camera.want(True)
    until = time.monotonic() + 10.0
    while not camera.connections and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(float(sys.argv[1]))
    print("cost", (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024, camera.connections, flush=True)


if __name__ == "__main__":
    main()
