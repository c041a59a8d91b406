"""Web sites that serve what a test wants, and a tablet that shows them."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest
from waiting import comes_true

from pepper_sim.tablet.tablet import Tablet
from telepresence.video.images import LatestImage
from telepresence.video.mjpeg import CONTENT_TYPE, MjpegStream
from telepresence.web.server import WebServer

Colour = tuple[int, int, int]


def encoded(colour: Colour, width: int = 640, height: int = 400, kind: str = ".jpg") -> bytes:
    pixels = np.full((height, width, 3), colour[::-1], np.uint8)
    return cv2.imencode(kind, pixels)[1].tobytes()


def answer(
    handler: http.server.BaseHTTPRequestHandler,
    body: bytes,
    kind: str = "text/html",
    status: int = 200,
    headers: dict[str, str] | None = None,
) -> None:
    handler.send_response(status)
    handler.send_header("Content-Type", kind)
    handler.send_header("Content-Length", str(len(body)))
    for name, value in (headers or {}).items():
        handler.send_header(name, value)
    handler.end_headers()
    handler.wfile.write(body)


class Site(http.server.ThreadingHTTPServer):
    """Routes are functions of the request handler; `seen` is what was asked for."""

    daemon_threads = True

    def __init__(self, port: int = 0) -> None:
        self.routes: dict[str, Callable[[http.server.BaseHTTPRequestHandler], None]] = {}
        self.seen: list[tuple[str, str | None]] = []
        site = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self) -> None:
                site.seen.append((self.path, self.headers.get("Cookie")))
                self.close_connection = True
                route = site.routes.get(self.path.partition("?")[0])
                try:
                    if route is None:
                        answer(self, b"<h1>Not here</h1>", status=404)
                    else:
                        route(self)
                except OSError:
                    pass  # the tablet has left

            def log_message(self, *_: object) -> None:
                pass

        super().__init__(("127.0.0.1", port), Handler)
        self._thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, name="site")
        self._thread.start()

    answer = staticmethod(answer)

    def url(self, path: str = "/") -> str:
        return f"http://127.0.0.1:{self.server_port}{path}"

    def serve(self, path: str, body: bytes | str, kind: str = "text/html", **options: object) -> None:
        data = body.encode() if isinstance(body, str) else body
        self.routes[path] = lambda handler: answer(handler, data, kind, **options)  # type: ignore[arg-type]

    def close(self) -> None:
        self.shutdown()
        self.server_close()
        self._thread.join()


@pytest.fixture
def other_threads() -> set[threading.Thread]:
    """Those that run before the test: other tests keep a robot with a tablet of its own."""
    return set(threading.enumerate())


@pytest.fixture
def site() -> Iterator[Site]:
    site = Site()
    yield site
    site.close()


class Glass:
    """A tablet, and what happened to it."""

    def __init__(self, browser: str = "built-in") -> None:
        self.shown: list[np.ndarray | None] = []
        self.events: list[object] = []
        self.tablet = Tablet(self.shown.append, browser)
        self.tablet.on_page_started = lambda: self.events.append("started")
        self.tablet.on_page_finished = lambda: self.events.append("finished")
        self.tablet.on_load_error = lambda code, text, url: self.events.append((code, text, url))
        self.tablet.on_image_loaded = lambda: self.events.append("image")

    def open(self, url: str) -> None:
        assert self.tablet.load_url(url)
        self.tablet.show_webview()

    def centre(self) -> Colour | None:
        picture = self.tablet.image.peek()
        return None if picture is None else tuple(int(v) for v in picture.content[200, 320])

    def shows(self, colour: Colour, timeout: float = 30.0) -> bool:
        def close() -> bool:
            centre = self.centre()
            return centre is not None and all(abs(a - b) < 12 for a, b in zip(centre, colour, strict=True))

        return comes_true(close, timeout)

    def ink(self) -> int:
        """Pixels that are written on a white page."""
        picture = self.tablet.image.peek()
        return 0 if picture is None else int((picture.content.max(axis=2) < 128).sum())


@pytest.fixture
def glass(make_glass: Callable[..., Glass]) -> Glass:
    return make_glass()


@pytest.fixture
def live() -> Iterator[tuple[LatestImage, WebServer]]:
    """The real page server's stream: chunked, plain or ?adv."""
    image = LatestImage()
    stream = MjpegStream(image)

    def application(environ: dict, start_response: Callable) -> object:
        if environ["PATH_INFO"] == "/video":
            start_response("200 OK", [("Content-Type", CONTENT_TYPE)])
            return stream.view(advance="adv" in environ["QUERY_STRING"])
        start_response("200 OK", [("Content-Type", "text/html")])
        return [b"<title>Pilot</title><img src='video?" + environ["QUERY_STRING"].encode() + b"'>"]

    with WebServer(application) as server:
        yield image, server


@pytest.fixture(name="encoded")
def _encoded() -> Callable[..., bytes]:
    return encoded


@pytest.fixture
def make_glass() -> Iterator[Callable[..., Glass]]:
    made: list[Glass] = []

    def make(browser: str = "built-in") -> Glass:
        made.append(Glass(browser))
        return made[-1]

    yield make
    for glass in made:
        glass.tablet.close()
