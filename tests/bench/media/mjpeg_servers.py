"""The two servers that the benchmark `mjpeg` compares, each a program of its own so that its processor time is its own.

    python mjpeg_servers.py ours VIDEO      com_cam's camera, page and stream
    python mjpeg_servers.py report VIDEO    the design of the Pepper report: every viewer captures and encodes

Both print the port they listen on, play VIDEO at 30 pictures/s and state the time of each picture in X-Timestamp.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator

import cv2

RATE = 30.0


def serve_ours(video: str) -> None:
    from telepresence_1.camera import Camera
    from telepresence_1.page import create_app

    from telepresence.video.mjpeg import MjpegStream
    from telepresence.web.server import WebServer

    with Camera(video, rate=RATE) as camera:
        stream = MjpegStream(camera.image)
        app = create_app(stream, name="bench", describe=lambda: (camera.status.state.value, camera.status.text))
        with WebServer(app) as server:
            print(server.port, flush=True)
            threading.Event().wait()


def serve_report(video: str) -> None:
    from flask import Flask, Response
    from werkzeug.serving import make_server

    app = Flask(__name__)

    def pictures() -> Iterator[bytes]:
        capture = cv2.VideoCapture(video)  # a webcam allows only one; a file lets the design at least try
        due = time.monotonic()
        while True:
            taken, picture = capture.read()
            if not taken:
                capture.set(cv2.CAP_PROP_POS_FRAMES, 0)
                continue
            stamp = time.time()
            _, data = cv2.imencode(".jpg", picture)
            head = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\nX-Timestamp: %.6f\r\n\r\n"
            yield head % (len(data), stamp) + data.tobytes() + b"\r\n"
            due = max(due + 1 / RATE, time.monotonic() - 1 / RATE)
            time.sleep(max(0.0, due - time.monotonic()))

    @app.get("/video_feed")
    def video_feed() -> Response:
        return Response(pictures(), content_type="multipart/x-mixed-replace; boundary=frame")

    server = make_server("127.0.0.1", 0, app, threaded=True)
    print(server.port, flush=True)
    server.serve_forever()


if __name__ == "__main__":
    {"ours": serve_ours, "report": serve_report}[sys.argv[1]](sys.argv[2])
