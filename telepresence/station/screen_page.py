"""Shows a virtual display as a web page, for machines without a screen: on loopback, or where a container publishes it.

The page is read-only: nothing that a browser sends reaches the display. It is shown to whoever has the key, which comes
from the environment's TELEPRESENCE_SCREEN_KEY (other users can read command lines); without one a new one is printed.
"""

from __future__ import annotations

import argparse
import signal
import socket
import threading
from pathlib import Path

import flask

from telepresence import ports
from telepresence.station.screen import SCREEN_KEY
from telepresence.station.virtual_display import grab
from telepresence.stop_signals import stop_on
from telepresence.video.images import LatestImage
from telepresence.video.jpeg import encode_jpeg
from telepresence.video.mjpeg import CONTENT_TYPE, MjpegStream, TooManyViewers
from telepresence.web.json_app import Application
from telepresence.web.page_auth import PageAuth, ProtectedPage, page_key
from telepresence.web.server import WebServer

PERIOD = 0.1  # seconds between pictures while somebody watches
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Operator's window</title>
<style>html, body { margin: 0; height: 100%; background: #15181d; }
img { width: 100%; height: 100%; object-fit: contain; }</style>
<img src="screen.mjpeg" alt="The window appears here when it opens."></html>"""


def create_app(stream: MjpegStream, key: str) -> Application:
    """Make the application: `/` is the page, `/screen.mjpeg` its picture, for whoever has `key`."""
    app = flask.Flask(__name__, static_folder=None)

    @app.get("/")
    def page() -> str:
        return PAGE

    @app.get("/screen.mjpeg")
    def screen() -> flask.Response:
        try:
            viewing = stream.view(advance=True, address=flask.request.remote_addr or "")
        except TooManyViewers as error:
            return flask.Response(f"{error}\n", 503, mimetype="text/plain")
        return flask.Response(viewing, content_type=CONTENT_TYPE)

    return ProtectedPage(app, PageAuth(key), "default-src 'none'; img-src 'self'; style-src 'unsafe-inline'")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m telepresence.station.screen_page", description=__doc__)
    parser.add_argument("folder", type=Path, help="where Xvfb's option -fbdir writes the screen")
    parser.add_argument("--port", type=int, default=ports.SCREEN_PAGE, help="default: %(default)s")
    parser.add_argument(
        "--address", default="127.0.0.1", help="address of this machine where the page is; default loopback"
    )
    parser.add_argument("--listening", type=int, help="descriptor of a socket that listens already, in place of both")
    arguments = parser.parse_args()
    listening = socket.socket(fileno=arguments.listening) if arguments.listening is not None else None
    stop = threading.Event()
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    image = LatestImage()
    stream = MjpegStream(image)
    key = page_key(SCREEN_KEY)
    with WebServer(create_app(stream, key), arguments.address, arguments.port, listening=listening) as server:
        print(f"listening on {server.url}?k={key}", flush=True)
        while not stop.wait(PERIOD):
            if stream.viewers:
                image.put(encode_jpeg(grab(arguments.folder), order="bgr"))


if __name__ == "__main__":
    main()
