"""Servers that mean harm: no memory, no time, no crash."""

from __future__ import annotations

import http.server
import tracemalloc
from collections.abc import Callable

import pytest

pytestmark = pytest.mark.slow

RED = (255, 0, 0)
GREEN = (0, 255, 0)
WHITE = (255, 255, 255)


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
def test_an_endless_answer_takes_no_memory(
    attack: str, site, glass, monkeypatch: pytest.MonkeyPatch, wait_until, encoded
) -> None:
    monkeypatch.setattr("pepper_sim.tablet.web_view.IMAGE_LIMIT", 3_000_000)
    site.routes["/"] = HOSTILE[attack]
    site.serve("/text", "text")
    site.serve("/good", encoded(GREEN), "image/jpeg")
    tracemalloc.start()
    try:
        glass.open(site.url())
        wait_until(lambda: "finished" in glass.events or len(glass.events) > 1, timeout=120)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 25_000_000
    glass.open(site.url("/good"))
    assert glass.shows(GREEN), "the tablet is still usable"


def test_a_picture_of_monstrous_size_is_not_decoded(site, glass, wait_until, encoded) -> None:
    """20 million pixels in a file of 50 kB."""
    site.serve("/", encoded(RED, 5000, 4000, ".png"), "image/png")
    glass.open(site.url())
    wait_until(lambda: "finished" in glass.events)
    wait_until(lambda: glass.ink() > 100, "words instead of the picture")
    assert glass.centre() == WHITE


@pytest.mark.parametrize("size", [(60_000, 60_000), (0, 10)])
def test_a_picture_that_lies_about_its_size_is_not_shown(
    size: tuple[int, int], site, glass, wait_until, encoded
) -> None:
    png = bytearray(encoded(RED, kind=".png"))
    png[16:24] = size[0].to_bytes(4, "big") + size[1].to_bytes(4, "big")
    site.serve("/", bytes(png), "image/png")
    glass.open(site.url())
    wait_until(lambda: "finished" in glass.events)
    wait_until(lambda: glass.ink() > 100, "words instead of the picture")


@pytest.mark.parametrize("unit", ["<", "<!--", "<![CDATA[", "<a ", "&", "<a b='", "<title>", "<img src='", "<?x", "</"])
def test_hostile_markup_is_read_in_linear_time(unit: str, site, glass, wait_until) -> None:
    site.serve("/", unit * (1_000_000 // len(unit)))
    glass.open(site.url())
    wait_until(lambda: "finished" in glass.events, timeout=30)
