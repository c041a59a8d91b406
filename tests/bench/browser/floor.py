"""The least age that VP8 allows: a picture is encoded, sent to another process by UDP, and decoded; nothing else.

`python floor.py PORT` sends to this machine's port. Encoder, pictures and rate are the page's.
"""

from __future__ import annotations

import socket
import struct
import subprocess
import sys
import time

import av
import cv2
from pictures import FRAMES, HEIGHT, WIDTH, frames

from telepresence.page.shared_video import TIME_BASE, SharedVideo
from telepresence.video.frame_timestamp import draw_time, read_age
from telepresence.video.images import LatestImage

RATE = 30.0
PIECE = 1200
_HEAD = struct.Struct("!IHH")  # picture, piece, pieces


def ages(seconds: float, warm_up: float = 2.0) -> list[float]:
    """Seconds from drawing the time to its decoded picture, one for each picture."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        listener.settimeout(10.0)
        sender = subprocess.Popen([sys.executable, __file__, str(listener.getsockname()[1])])
        try:
            return _receive(listener, time.monotonic() + warm_up, seconds)
        finally:
            sender.terminate()
            sender.wait(10)


def _receive(listener: socket.socket, begin: float, seconds: float) -> list[float]:
    decoder, found, pieces, number = av.CodecContext.create("vp8", "r"), [], {}, -1
    decoder.thread_count = 1
    while time.monotonic() < begin + seconds:
        data = listener.recv(2048)
        picture, piece, count = _HEAD.unpack_from(data)
        if picture != number:
            pieces, number = {}, picture
        pieces[piece] = data[_HEAD.size :]
        if len(pieces) < count:
            continue
        for frame in decoder.decode(av.Packet(b"".join(pieces[index] for index in range(count)))):
            age = read_age(frame.to_ndarray()[: frame.height], time.time())
            if age is not None and time.monotonic() >= begin:
                found.append(age)
    return found


def send(port: int) -> None:
    encoder = SharedVideo(LatestImage(), lambda _: None)._open(WIDTH, HEIGHT)
    round_of, due, began = frames(), time.monotonic(), time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for number in range(1 << 30):
            rgb = round_of[number % FRAMES]
            draw_time(rgb, time.time())
            frame = av.VideoFrame.from_ndarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_I420), format="yuv420p")
            frame.pts, frame.time_base = round((time.monotonic() - began) / TIME_BASE), TIME_BASE
            for packet in encoder.encode(frame):
                data = bytes(packet)
                count = -(-len(data) // PIECE)
                for piece in range(count):
                    part = data[piece * PIECE : (piece + 1) * PIECE]
                    out.sendto(_HEAD.pack(number, piece, count) + part, ("127.0.0.1", port))
            due += 1.0 / RATE
            time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    send(int(sys.argv[1]))
