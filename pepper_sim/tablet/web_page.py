"""What a web view without scripts and style sheets shows: a page's picture, or else its text; and an error page."""

from __future__ import annotations

import html.parser
import urllib.parse

import numpy as np

from pepper_sim.body.description import SCREEN_HEIGHT, SCREEN_WIDTH
from telepresence.video.draw_text import write

_BLOCKS = frozenset("p div h1 h2 h3 h4 h5 h6 li ul ol br tr table section header footer main article hr pre".split())
_INVISIBLE = frozenset("script style head template noscript svg".split())
_TEXT_LIMIT = 2000  # characters; more than the screen holds
_INK, _GREY = (33, 33, 33), (117, 117, 117)


class PageReader(html.parser.HTMLParser):
    """Reads HTML: `title`, `lines` of text, and `image`, the address of the first <img> (None without one).

    Args:
        url: Address of the page; relative addresses start there or at its <base>.
    """

    def __init__(self, url: str) -> None:
        super().__init__(convert_charrefs=True)
        self.image: str | None = None
        self._base = url
        self._title: list[str] = []
        self._text: list[str] = []
        self._size = 0
        self._inside: list[str] = []

    @property
    def title(self) -> str:
        return " ".join("".join(self._title).split())

    @property
    def lines(self) -> list[str]:
        lines = (" ".join(line.split()) for line in "".join(self._text).split("\n"))
        return [line for line in lines if line]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(reversed(attrs))  # the first of repeated attributes counts
        if tag == "base" and attributes.get("href"):
            self._base = self._resolve(attributes["href"]) or self._base
        elif tag in ("img", "input") and self.image is None and attributes.get("src"):
            if tag == "img" or (attributes.get("type") or "").lower() == "image":
                self.image = self._resolve(attributes["src"])
        elif tag in _INVISIBLE or tag == "title":
            self._inside.append(tag)
        if tag in _BLOCKS:
            self._text.append("\n")

    def handle_endtag(self, tag: str) -> None:
        if tag in self._inside:
            while self._inside.pop() != tag:
                pass
        if tag in _BLOCKS:
            self._text.append("\n")

    def handle_data(self, data: str) -> None:
        if self._size > _TEXT_LIMIT:
            return
        if self._inside and self._inside[-1] == "title":
            self._title.append(data)
        elif not self._inside:
            self._text.append(data)
        else:
            return
        self._size += len(data)

    def _resolve(self, address: str | None) -> str | None:
        try:
            url = urllib.parse.urljoin(self._base, (address or "").strip())
        except ValueError:
            return None
        return url if url.startswith(("http://", "https://")) else None


def draw_text_page(title: str, lines: list[str]) -> np.ndarray:
    """Draw a page of text, (400, 640, 3) uint8 RGB."""
    page = np.full((SCREEN_HEIGHT, SCREEN_WIDTH, 3), 255, np.uint8)
    top = 36
    if title:
        top = write(page, title[:200], 32, top, 17, _INK, weight=1.5, width=SCREEN_WIDTH - 64) + 8
    for line in lines:
        if top > SCREEN_HEIGHT:
            break
        top = write(page, line[:_TEXT_LIMIT], 32, top, 12, _INK, width=SCREEN_WIDTH - 64) + 4
    return page


def draw_error_page(url: str, text: str) -> np.ndarray:
    """Draw what Android's web view shows instead of a page that did not load, (400, 640, 3) uint8 RGB."""
    page = np.full((SCREEN_HEIGHT, SCREEN_WIDTH, 3), 255, np.uint8)
    page[48:104, 48:92] = _GREY  # a sheet of paper with a sad face
    page[51:101, 51:89] = 255
    page[66:71, 60:65] = page[66:71, 75:80] = _GREY
    page[84:87, 62:78] = page[87:90, 59:62] = page[87:90, 78:81] = _GREY
    top = write(page, "Web page not available", 48, 132, 18, _INK, weight=1.5)
    top = write(
        page,
        f"The web page at {url[:300]} could not be loaded because:",
        48,
        top + 8,
        11,
        _INK,
        width=SCREEN_WIDTH - 96,
    )
    write(page, text, 48, top + 8, 11, _GREY, width=SCREEN_WIDTH - 96)
    return page
