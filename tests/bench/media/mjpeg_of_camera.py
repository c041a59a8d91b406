"""The camera sender's test picture as MJPEG, and a program that reads it: the reference of bench_webrtc.

`python mjpeg_of_camera.py RATE` serves http://127.0.0.1:PORT/ and prints it; every picture carries its time.
"""

from __future__ import annotations

import http.client
import sys
import time
from collections.abc import Iterator

import cv2
import numpy as np
from rto_bringup.onboard.picture_sources import open_source

from telepresence.video.frame_timestamp import read_age
from telepresence.video.images import LatestImage
from telepresence.video.mjpeg import CONTENT_TYPE, MjpegStream
from telepresence.video.webrtc import with_time
from telepresence.web.server import WebServer

SIZE = (640, 480)
QUALITY = 80


def main(rate: float) -> None:
    source = open_source("test", rate, SIZE)
    jpegs = LatestImage()
    stream = MjpegStream(jpegs)

    def application(environ, start_response):
        start_response("200 OK", [("Content-Type", CONTENT_TYPE)])
        return stream.view()

    source.watch()
    with WebServer(application) as server:
        print(server.url, flush=True)
        sequence = 0
        while True:
            picture = source.image.wait_newer(sequence, 1.0)
            if picture is None:
                continue
            sequence = picture.sequence
            pixels = cv2.cvtColor(with_time(picture.content, picture.stamp), cv2.COLOR_YUV2BGR_I420)
            _, data = cv2.imencode(".jpg", pixels, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
            jpegs.put(data.tobytes(), picture.stamp)


def read_pictures(url: str) -> Iterator[float | None]:
    """The age [s] of each picture when it has been decoded; None for one whose time cannot be read."""
    connection = http.client.HTTPConnection(url.split("/")[2], timeout=10.0)
    connection.request("GET", "/")
    response = connection.getresponse()
    try:
        while True:
            length = 0
            while (line := response.readline()) not in (b"\r\n", b""):
                name, _, value = line.decode().partition(":")
                length = int(value) if name.lower() == "content-length" else length
            if line == b"":
                raise RuntimeError("the MJPEG stream ended")
            if length:
                pixels = cv2.imdecode(np.frombuffer(response.read(length), np.uint8), cv2.IMREAD_COLOR)
                yield read_age(pixels, time.time())
                response.readline()
    finally:
        connection.close()


if __name__ == "__main__":
    main(float(sys.argv[1]))
