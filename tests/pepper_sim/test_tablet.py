"""The tablet against real HTTP servers: friendly, clumsy and hostile ones."""

from __future__ import annotations

import http.server
import socket
import threading
import time
import tracemalloc
from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest

from pepper_sim.tablet import Tablet
from telepresence.images import LatestImage
from telepresence.mjpeg import CONTENT_TYPE, MjpegStream, WebServer

RED, GREEN, BLUE, WHITE, BLACK = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255), (0, 0, 0)
Colour = tuple[int, int, int]


def encoded(colour: Colour, width: int = 640, height: int = 400, kind: str = ".jpg") -> bytes:
    pixels = np.full((height, width, 3), colour[::-1], np.uint8)
    return cv2.imencode(kind, pixels)[1].tobytes()


def eventually(condition: Callable[[], bool], timeout: float = 10.0) -> bool:
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


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

    def url(self, path: str = "/") -> str:
        return f"http://127.0.0.1:{self.server_port}{path}"

    def serve(self, path: str, body: bytes | str, kind: str = "text/html", **options: object) -> None:
        data = body.encode() if isinstance(body, str) else body
        self.routes[path] = lambda handler: answer(handler, data, kind, **options)  # type: ignore[arg-type]

    def close(self) -> None:
        self.shutdown()
        self.server_close()
        self._thread.join()


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
        return None if picture is None else tuple(int(v) for v in picture.pixels[200, 320])

    def shows(self, colour: Colour, timeout: float = 10.0) -> bool:
        def close() -> bool:
            centre = self.centre()
            return centre is not None and all(abs(a - b) < 12 for a, b in zip(centre, colour, strict=True))

        return eventually(close, timeout)

    def ink(self) -> int:
        """Pixels that are written on a white page."""
        picture = self.tablet.image.peek()
        return 0 if picture is None else int((picture.pixels.max(axis=2) < 128).sum())


@pytest.fixture
def glass() -> Iterator[Glass]:
    glass = Glass()
    yield glass
    glass.tablet.close()


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


@pytest.mark.parametrize("layout", ["", "adv"])
def test_follows_the_stream_of_a_page(layout: str, live: tuple[LatestImage, WebServer], glass: Glass) -> None:
    image, server = live
    image.put(encoded(RED))
    glass.open(f"{server.url}?{layout}")
    for colour in (RED, GREEN, BLUE, RED):
        image.put(encoded(colour))
        assert glass.shows(colour)
    assert glass.events == ["started", "finished"]
    shown = glass.shown[-1]
    assert shown is not None and shown.shape == (400, 640, 3) and shown.dtype == np.uint8


def test_goes_straight_to_a_stream(live: tuple[LatestImage, WebServer], glass: Glass) -> None:
    image, server = live
    image.put(encoded(BLUE))
    glass.open(server.url + "video")
    assert glass.shows(BLUE)


def test_shows_at_most_fifteen_pictures_a_second_and_always_the_last(
    live: tuple[LatestImage, WebServer], glass: Glass
) -> None:
    image, server = live
    image.put(encoded(BLACK))
    glass.open(server.url)
    assert glass.shows(BLACK)
    before, begin = len(glass.shown), time.monotonic()
    for number in range(100):
        image.put(encoded((number, 0, 0)))
        time.sleep(0.005)
    image.put(encoded(GREEN))
    assert glass.shows(GREEN)
    assert len(glass.shown) - before <= (time.monotonic() - begin) * 15 + 2


def test_letterboxes_a_narrow_picture_on_the_background(site: Site, glass: Glass) -> None:
    site.serve("/", encoded(RED, 640, 480, ".png"), "image/png")
    glass.tablet.set_background("#0000fF")
    glass.open(site.url())
    assert glass.shows(RED)
    screen = glass.tablet.image.peek().pixels
    assert tuple(screen[200, 10]) == BLUE and tuple(screen[200, 630]) == BLUE
    assert tuple(screen[0, 320]) == RED and tuple(screen[399, 320]) == RED
    assert (screen[200] == RED).all(axis=1).sum() == 533


@pytest.mark.parametrize(
    "markup",
    [
        "<img src='/pictures/red.png'>",
        '<IMG ALT="x>y" class=a SRC=pictures/red.png width=100%>',
        "<img id='a' src=\n'../pictures/red.png?a=1&amp;b=2' />",
        "<script>var s = '<img src=nowhere>';</script><!-- <img src=nowhere> --><img src=pictures/red.png>",
        "<base href='/pictures/'><p><img data-src=x src='red.png'",
    ],
)
def test_finds_the_picture_of_a_page(markup: str, site: Site, glass: Glass) -> None:
    site.serve("/", markup + "><p>words")
    site.serve("/pictures/red.png", encoded(RED, kind=".png"), "image/png")
    glass.open(site.url())
    assert glass.shows(RED)
    assert eventually(lambda: glass.events == ["started", "finished"])


def test_keeps_cookies_over_redirects(site: Site, glass: Glass) -> None:
    def door(handler: http.server.BaseHTTPRequestHandler) -> None:
        if "k=secret" in handler.path:
            cookie = {"Location": "/", "Set-Cookie": "tp=secret; HttpOnly; SameSite=Lax; Path=/"}
            answer(handler, b"", status=302, headers=cookie)
        elif handler.headers.get("Cookie") == "tp=secret":
            answer(handler, b"<img src=picture>")
        else:
            answer(handler, b"Forbidden", status=403)

    site.routes["/"] = door
    site.serve("/picture", encoded(GREEN), "image/jpeg")
    glass.open(site.url("/?k=secret"))
    assert glass.shows(GREEN)
    assert site.seen == [("/?k=secret", None), ("/", "tp=secret"), ("/picture", "tp=secret")]


def test_writes_a_page_without_pictures(site: Site, glass: Glass) -> None:
    site.serve("/", "<title>Not so fast</title><style>p{}</style><p>You need a key")
    glass.open(site.url())
    assert eventually(lambda: glass.ink() > 500)
    assert glass.centre() == WHITE
    assert eventually(lambda: glass.events == ["started", "finished"])


def test_writes_the_servers_own_error_page(site: Site, glass: Glass) -> None:
    glass.open(site.url("/nowhere"))
    assert eventually(lambda: glass.ink() > 100)
    assert eventually(lambda: glass.events == ["started", "finished"])


def test_a_refused_connection_is_an_error_page_and_an_event(glass: Glass) -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}/"
        glass.open(url)
        assert eventually(lambda: len(glass.events) == 2)
    assert glass.events == ["started", (-6, "net::ERR_CONNECTION_REFUSED", url)]
    assert eventually(lambda: glass.ink() > 500)


@pytest.mark.parametrize(
    ("reply", "code"),
    [(b"", -7), (b"gibberish\r\n\r\n", -1), (b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 2000 + b"\r\n", -1)],
)
def test_a_server_that_does_not_speak_http_is_a_load_error(reply: bytes, code: int, glass: Glass) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        glass.open(f"http://127.0.0.1:{server.getsockname()[1]}/")
        peer, _ = server.accept()
        with peer:
            peer.recv(65536)
            peer.sendall(reply)
    assert eventually(lambda: len(glass.events) == 2)
    assert glass.events[1][0] == code


@pytest.mark.parametrize("target", ["file:///etc/passwd", "ftp://127.0.0.1/", "javascript:alert(1)"])
def test_a_redirect_out_of_http_is_refused(target: str, site: Site, glass: Glass) -> None:
    site.serve("/", b"", status=302, headers={"Location": target})
    glass.open(site.url())
    assert eventually(lambda: len(glass.events) == 2)
    assert glass.events[1][:2] == (-10, "net::ERR_UNKNOWN_URL_SCHEME")


def test_a_circle_of_redirects_ends(site: Site, glass: Glass) -> None:
    site.serve("/", b"", status=302, headers={"Location": "/"})
    glass.open(site.url())
    assert eventually(lambda: len(glass.events) == 2)
    assert glass.events[1][:2] == (-9, "net::ERR_TOO_MANY_REDIRECTS")
    assert len(site.seen) <= 11


@pytest.mark.parametrize(
    "url", ["file:///etc/passwd", "data:text/html,x", "127.0.0.1", "http://", "http://a b/", "http://x:99999/", ""]
)
def test_refuses_what_is_no_web_address(url: str, glass: Glass) -> None:
    assert not glass.tablet.load_url(url)
    assert not glass.tablet.show_image(url)
    assert glass.tablet.url is None


def test_reconnects_when_the_stream_drops(glass: Glass) -> None:
    image = LatestImage()
    stream = MjpegStream(image)

    def application(environ: dict, start_response: Callable) -> object:
        start_response("200 OK", [("Content-Type", CONTENT_TYPE)])
        return stream.view()

    image.put(encoded(RED))
    with WebServer(application) as server:
        port = server.port
        glass.open(server.url)
        assert glass.shows(RED)
    image.put(encoded(GREEN))
    with WebServer(application, port=port):
        assert glass.shows(GREEN)


def test_a_stream_that_stays_away_is_dimmed_and_says_so(glass: Glass, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pepper_sim.web_view.RETRY_DELAYS", (0.05,))
    image = LatestImage()
    image.put(encoded(WHITE))
    stream = MjpegStream(image)

    def application(environ: dict, start_response: Callable) -> object:
        start_response("200 OK", [("Content-Type", CONTENT_TYPE)])
        return stream.view()

    with WebServer(application) as server:
        glass.open(server.url)
        assert glass.shows(WHITE)
    assert glass.shows((114, 114, 114))


def test_retries_a_page_whose_stream_is_full(glass: Glass, site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pepper_sim.web_view.RETRY_DELAYS", (0.05,))
    site.serve("/", "<img src=video>")
    site.serve("/video", "full", status=503)
    glass.open(site.url())
    assert eventually(lambda: len(site.seen) > 3)
    site.serve("/video", encoded(BLUE), "image/jpeg")
    assert glass.shows(BLUE)


def part_streams() -> dict[str, tuple[str, Callable[[bytes], bytes]]]:
    return {
        "length": ("b", lambda p: b"--b\r\nContent-Type: image/jpeg\r\ncontent-length: %d\r\n\r\n%b\r\n" % (len(p), p)),
        "no length": ("b", lambda p: b"--b\r\nContent-Type: image/jpeg\r\n\r\n" + p + b"\r\n"),
        "dashes in the name": ("--b", lambda p: b"--b\r\nContent-Type: image/jpeg\r\n\r\n" + p + b"\r\n"),
        "line feeds": ('"b"', lambda p: b"--b\nContent-Type: image/jpeg\n\n" + p + b"\n"),
        "no headers": ("b", lambda p: b"--b\r\n\r\n" + p + b"\r\n"),
    }


@pytest.mark.parametrize("kind", part_streams())
@pytest.mark.parametrize("slice_size", [7, 1000, 1_000_000])
def test_reads_every_dialect_of_multipart(kind: str, slice_size: int, site: Site, glass: Glass) -> None:
    boundary, part = part_streams()[kind]
    done = threading.Event()

    def video(handler: http.server.BaseHTTPRequestHandler) -> None:
        handler.send_response(200)
        handler.send_header("Content-Type", f"multipart/x-mixed-replace;boundary={boundary}")
        handler.end_headers()
        data = b"preamble\r\n" + part(encoded(RED)) + part(b"damaged") + part(encoded(GREEN)) + part(b"")
        for position in range(0, len(data), slice_size):
            handler.wfile.write(data[position : position + slice_size])
        done.wait(10)

    site.routes["/"] = video
    glass.open(site.url())
    try:
        assert glass.shows(GREEN)
    finally:
        done.set()


def endless(
    head: bytes, body: bytes, status: bytes = b"200 OK"
) -> Callable[[http.server.BaseHTTPRequestHandler], None]:
    def route(handler: http.server.BaseHTTPRequestHandler) -> None:
        handler.wfile.write(b"HTTP/1.1 " + status + b"\r\n" + head + b"\r\n")
        while True:
            handler.wfile.write(body)

    return route


MEGABYTE = bytes(1_000_000)
HOSTILE = {
    "endless page": endless(b"Content-Type: text/html\r\n\r\n", b"<p>more" * 10_000),
    "endless picture": endless(b"Content-Type: image/jpeg\r\n\r\n", MEGABYTE),
    "endless part": endless(b"Content-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n--b\r\n\r\n", MEGABYTE),
    "endless headers of a part": endless(b"Content-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n--b", MEGABYTE),
    "no boundary": endless(b"Content-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n", MEGABYTE),
    "endless redirect": endless(b"Location: /text\r\n\r\n", MEGABYTE, b"302 Found"),
    "endless headers": endless(b"", b"X: y\r\n" * 1000),
    "endless chunk": endless(b"Content-Type: text/html\r\nTransfer-Encoding: chunked\r\n\r\nfffffffff\r\n", MEGABYTE),
}


@pytest.mark.parametrize("attack", HOSTILE)
def test_an_endless_answer_takes_no_memory(attack: str, site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pepper_sim.web_view.IMAGE_LIMIT", 3_000_000)
    glass = Glass()
    connections = []

    def attacker(handler: http.server.BaseHTTPRequestHandler) -> None:
        connections.append(handler)
        HOSTILE[attack](handler)

    site.routes["/"] = attacker
    site.serve("/text", "text")
    site.serve("/good", encoded(GREEN), "image/jpeg")
    tracemalloc.start()
    try:
        glass.open(site.url())
        assert eventually(lambda: "finished" in glass.events or len(glass.events) > 1)
        peak = tracemalloc.get_traced_memory()[1]
        glass.open(site.url("/good"))
        assert glass.shows(GREEN), "the tablet is still usable"
        assert peak < 25_000_000
    finally:
        tracemalloc.stop()
        glass.tablet.close()


def test_a_picture_of_monstrous_size_is_not_decoded(site: Site, glass: Glass) -> None:
    """20 million pixels in a file of 50 kB."""
    site.serve("/", encoded(RED, 5000, 4000, ".png"), "image/png")
    glass.open(site.url())
    assert eventually(lambda: "finished" in glass.events)
    assert eventually(lambda: glass.ink() > 100) and glass.centre() == WHITE, "words instead of the picture"


@pytest.mark.parametrize("size", [(60_000, 60_000), (0, 10)])
def test_a_picture_that_lies_about_its_size_is_not_shown(size: tuple[int, int], site: Site, glass: Glass) -> None:
    png = bytearray(encoded(RED, kind=".png"))
    png[16:24] = size[0].to_bytes(4, "big") + size[1].to_bytes(4, "big")
    site.serve("/", bytes(png), "image/png")
    glass.open(site.url())
    assert eventually(lambda: "finished" in glass.events)
    assert eventually(lambda: glass.ink() > 100), "words instead of the picture"


@pytest.mark.parametrize("unit", ["<", "<!--", "<![CDATA[", "<a ", "&", "<a b='", "<title>", "<img src='", "<?x", "</"])
def test_hostile_markup_is_read_in_linear_time(unit: str, site: Site, glass: Glass) -> None:
    site.serve("/", unit * (1_000_000 // len(unit)))
    glass.open(site.url())
    assert eventually(lambda: "finished" in glass.events, timeout=5)


def test_an_image_covers_the_page_until_hidden(site: Site, glass: Glass) -> None:
    site.serve("/page", "<img src=red>")
    site.serve("/red", encoded(RED), "image/jpeg")
    transparent = np.zeros((400, 640, 4), np.uint8)
    site.serve("/transparent", cv2.imencode(".png", transparent)[1].tobytes(), "image/png")
    glass.open(site.url("/page"))
    assert glass.shows(RED)
    glass.tablet.set_background("#00FF00")
    assert glass.tablet.show_image(site.url("/transparent"))
    assert glass.shows(GREEN)
    assert "image" in glass.events
    glass.tablet.hide_image()
    assert glass.shows(RED)
    glass.tablet.hide_webview()
    assert glass.shows(BLACK)
    assert glass.shown[-1] is None and not glass.tablet.visible


def test_a_page_loaded_while_hidden_is_there_when_shown(site: Site, glass: Glass) -> None:
    site.serve("/", encoded(BLUE), "image/jpeg")
    glass.tablet.load_url(site.url())
    assert eventually(lambda: glass.events == ["started", "finished"])
    assert glass.shown == []
    glass.tablet.show_webview()
    assert glass.shows(BLUE)


def test_reload_asks_again(site: Site, glass: Glass) -> None:
    site.serve("/", encoded(BLUE), "image/jpeg")
    glass.open(site.url())
    assert glass.shows(BLUE)
    site.serve("/", encoded(RED), "image/jpeg")
    glass.tablet.reload(True)
    assert glass.shows(RED)


def test_a_new_address_replaces_a_page_that_hangs(site: Site, glass: Glass) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        glass.open(f"http://127.0.0.1:{silent.getsockname()[1]}/")
        assert eventually(lambda: glass.events == ["started"])
        site.serve("/", encoded(GREEN), "image/jpeg")
        glass.open(site.url())
        assert glass.shows(GREEN)
    assert glass.events == ["started", "started", "finished"]


def test_closing_leaves_no_thread(
    site: Site, live: tuple[LatestImage, WebServer], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pepper_sim.http_fetch.READ_TIMEOUT", 60.0)
    image, server = live
    image.put(encoded(RED))
    with socket.create_server(("127.0.0.1", 0)) as silent:
        for url in (server.url, f"http://127.0.0.1:{silent.getsockname()[1]}/", site.url("/nowhere")):
            with Tablet() as tablet:
                tablet.load_url(url)
                tablet.show_webview()
                tablet.show_image(url)
                assert eventually(lambda tablet=tablet: tablet.image.peek() is not None)
            assert not tablet.load_url(url)
            assert not [t.name for t in threading.enumerate() if t.name.startswith("tablet")]


def test_a_broken_owner_does_not_stop_the_screen(site: Site) -> None:
    def show(pixels: np.ndarray | None) -> None:
        raise RuntimeError("the owner's mistake")

    site.serve("/", encoded(RED), "image/jpeg")
    with Tablet(show) as tablet:
        tablet.load_url(site.url())
        tablet.show_webview()
        tablet.hide_webview()
        assert any(t.name == "tablet-screen" for t in threading.enumerate())


def test_background_must_be_a_colour(glass: Glass) -> None:
    with pytest.raises(ValueError, match="#RRGGBB"):
        glass.tablet.set_background("red")


@pytest.fixture
def chromium() -> Iterator[Glass]:
    glass = Glass("chromium")
    yield glass
    glass.tablet.close()


@pytest.mark.browser
def test_chromium_runs_scripts_and_styles(site: Site, chromium: Glass) -> None:
    site.serve("/", "<style>body{background:#f00}</style>")
    site.serve(
        "/script", "<script>document.documentElement.style.background = innerWidth == 1280 ? '#0f0' : '#00f'</script>"
    )
    chromium.open(site.url())
    assert chromium.shows(RED, timeout=30)
    chromium.open(site.url("/script"))
    assert chromium.shows(GREEN)
    assert eventually(lambda: chromium.events == ["started", "finished"] * 2)
    chromium.tablet.hide_webview()
    assert chromium.shows(BLACK)


@pytest.mark.browser
def test_chromium_follows_a_stream(live: tuple[LatestImage, WebServer], chromium: Glass) -> None:
    image, server = live
    image.put(encoded(RED))
    chromium.open(server.url + "?adv")
    for colour in (RED, GREEN, BLUE):
        image.put(encoded(colour))
        assert eventually(lambda colour=colour: shows_anywhere(chromium, colour), timeout=30)
    assert eventually(lambda: "finished" in chromium.events)


def shows_anywhere(glass: Glass, colour: Colour) -> bool:
    picture = glass.tablet.image.peek()
    return picture is not None and bool((abs(picture.pixels[60, 60].astype(int) - colour) < 20).all())


@pytest.mark.browser
def test_chromium_reports_what_does_not_load_and_leaves_nothing_behind(chromium: Glass) -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}/"
        chromium.open(url)
        assert eventually(lambda: len(chromium.events) == 2, timeout=30)
    assert chromium.events[1] == (-6, "net::ERR_CONNECTION_REFUSED", url)
    assert eventually(lambda: chromium.ink() > 500)
    chromium.tablet.close()
    assert not [t.name for t in threading.enumerate() if t.name.startswith("tablet")]


def test_an_unknown_browser_is_named() -> None:
    with pytest.raises(ValueError, match="not 'lynx'"):
        Tablet(browser="lynx")
