"""The built-in web view against real servers, friendly and clumsy ones."""

from __future__ import annotations

import http.server
import socket
import threading
from collections.abc import Callable

import numpy as np
import pytest

from telepresence.video.images import LatestImage
from telepresence.video.mjpeg import CONTENT_TYPE, MjpegStream
from telepresence.web.server import WebServer

RED = (255, 0, 0)
GREEN = (0, 255, 0)
BLUE = (0, 0, 255)
WHITE = (255, 255, 255)


@pytest.mark.parametrize("layout", ["", "adv"])
def test_follows_the_stream_of_a_page(layout: str, live, glass, encoded) -> None:
    image, server = live
    image.put(encoded(RED))
    glass.open(f"{server.url}?{layout}")
    for colour in (RED, GREEN, BLUE, RED):
        image.put(encoded(colour))
        assert glass.shows(colour)
    assert glass.events == ["started", "finished"]
    shown = glass.shown[-1]
    assert shown is not None and shown.shape == (400, 640, 3) and shown.dtype == np.uint8


def test_goes_straight_to_a_stream(live, glass, encoded) -> None:
    image, server = live
    image.put(encoded(BLUE))
    glass.open(server.url + "video")
    assert glass.shows(BLUE)


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
def test_finds_the_picture_of_a_page(markup: str, site, glass, wait_until, encoded) -> None:
    site.serve("/", markup + "><p>words")
    site.serve("/pictures/red.png", encoded(RED, kind=".png"), "image/png")
    glass.open(site.url())
    assert glass.shows(RED)
    wait_until(lambda: glass.events == ["started", "finished"])


def test_keeps_cookies_over_redirects(site, glass, encoded) -> None:
    def sign_in(handler: http.server.BaseHTTPRequestHandler) -> None:
        if "k=secret" in handler.path:
            cookie = {"Location": "/", "Set-Cookie": "tp=secret; HttpOnly; SameSite=Lax; Path=/"}
            site.answer(handler, b"", status=302, headers=cookie)
        elif handler.headers.get("Cookie") == "tp=secret":
            site.answer(handler, b"<img src=picture>")
        else:
            site.answer(handler, b"Forbidden", status=403)

    site.routes["/"] = sign_in
    site.serve("/picture", encoded(GREEN), "image/jpeg")
    glass.open(site.url("/?k=secret"))
    assert glass.shows(GREEN)
    assert site.seen == [("/?k=secret", None), ("/", "tp=secret"), ("/picture", "tp=secret")]


def test_writes_a_page_without_pictures(site, glass, wait_until) -> None:
    site.serve("/", "<title>Not so fast</title><style>p{}</style><p>You need a key")
    glass.open(site.url())
    wait_until(lambda: glass.ink() > 500)
    assert glass.centre() == WHITE
    wait_until(lambda: glass.events == ["started", "finished"])


def test_writes_the_servers_own_error_page(site, glass, wait_until) -> None:
    glass.open(site.url("/nowhere"))
    wait_until(lambda: glass.ink() > 100)
    wait_until(lambda: glass.events == ["started", "finished"])


def test_a_refused_connection_is_an_error_page_and_an_event(glass, wait_until) -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}/"
        glass.open(url)
        wait_until(lambda: len(glass.events) == 2)
    assert glass.events == ["started", (-6, "net::ERR_CONNECTION_REFUSED", url)]
    wait_until(lambda: glass.ink() > 500)


@pytest.mark.parametrize(
    ("reply", "code"),
    [(b"", -7), (b"gibberish\r\n\r\n", -1), (b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 2000 + b"\r\n", -1)],
)
def test_a_server_that_does_not_speak_http_is_a_load_error(reply: bytes, code: int, glass, wait_until) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        glass.open(f"http://127.0.0.1:{server.getsockname()[1]}/")
        peer, _ = server.accept()
        with peer:
            peer.recv(65536)
            peer.sendall(reply)
    wait_until(lambda: len(glass.events) == 2)
    assert glass.events[1][0] == code


@pytest.mark.parametrize("target", ["file:///etc/passwd", "ftp://127.0.0.1/", "javascript:alert(1)"])
def test_a_redirect_out_of_http_is_refused(target: str, site, glass, wait_until) -> None:
    site.serve("/", b"", status=302, headers={"Location": target})
    glass.open(site.url())
    wait_until(lambda: len(glass.events) == 2)
    assert glass.events[1][:2] == (-10, "net::ERR_UNKNOWN_URL_SCHEME")


def test_a_redirect_to_another_server_is_not_followed(site, glass, wait_until) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        target = f"http://127.0.0.1:{other.getsockname()[1]}/"
        site.serve("/", b"", status=302, headers={"Location": target})
        glass.open(site.url())
        wait_until(lambda: len(glass.events) == 2)
        assert glass.events[1][:2] == (-6, "net::ERR_UNSAFE_REDIRECT")
        other.settimeout(0.0)
        with pytest.raises(BlockingIOError):
            other.accept()


def test_a_circle_of_redirects_ends(site, glass, wait_until) -> None:
    site.serve("/", b"", status=302, headers={"Location": "/"})
    glass.open(site.url())
    wait_until(lambda: len(glass.events) == 2)
    assert glass.events[1][:2] == (-9, "net::ERR_TOO_MANY_REDIRECTS")
    assert len(site.seen) <= 11


def test_reconnects_when_the_stream_drops(glass, encoded) -> None:
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


def test_a_stream_that_stays_away_is_dimmed_and_says_so(glass, monkeypatch: pytest.MonkeyPatch, encoded) -> None:
    monkeypatch.setattr("pepper_sim.tablet.web_view.RETRY_DELAYS", (0.05,))
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


def test_retries_a_page_whose_stream_is_full(glass, site, monkeypatch: pytest.MonkeyPatch, wait_until, encoded) -> None:
    monkeypatch.setattr("pepper_sim.tablet.web_view.RETRY_DELAYS", (0.05,))
    site.serve("/", "<img src=video>")
    site.serve("/video", "full", status=503)
    glass.open(site.url())
    wait_until(lambda: len(site.seen) > 3)
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
def test_reads_every_dialect_of_multipart(kind: str, slice_size: int, site, glass, encoded) -> None:
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
