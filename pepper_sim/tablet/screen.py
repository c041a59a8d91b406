"""The tablet's screen: the newest content of its top layer, letterboxed, at most fifteen times a second."""

from __future__ import annotations

import logging
import struct
import threading
import time
from collections.abc import Callable

import cv2
import numpy as np

from pepper_sim.body.description import SCREEN_HEIGHT, SCREEN_WIDTH
from telepresence.video.draw_text import text_width, write
from telepresence.video.images import LatestImage
from telepresence.video.jpeg import decode_jpeg

log = logging.getLogger(__name__)

PERIOD = 1.0 / 15.0
"""Shortest time between two pictures [s]."""
_DIMMEST = 0.25
_PNG = b"\x89PNG\r\n\x1a\n"
MAX_PIXELS = 16_000_000
"""Larger pictures are refused before they are decoded: a few kilobytes can claim any size."""


class Layer:
    """The content of one page or image. Its owner puts new content, the screen shows the newest.

    `put` takes an encoded JPEG or PNG (decoded only when it is shown) or a drawn (400, 640, 3) RGB array. `note` is a
    line that is drawn over the picture, None for no note.
    """

    def __init__(self, content: bytes | np.ndarray | None = None) -> None:
        self.content = content
        self.note: str | None = None
        self.on_change: Callable[[], None] = lambda: None

    def put(self, content: bytes | np.ndarray, note: str | None = None) -> None:
        self.content, self.note = content, note
        self.on_change()

    def set_note(self, note: str | None) -> None:
        self.note = note
        self.on_change()


class Screen:
    """Draws the top layer from a thread of its own.

    Args:
        show: Receives each new picture, (400, 640, 3) uint8 RGB, or None when the screen turns dark.
    """

    def __init__(self, show: Callable[[np.ndarray | None], None]) -> None:
        self.image = LatestImage()
        self._show = show
        self._background = (0, 0, 0)
        self._brightness = 1.0
        self._on = True
        self._layer: Layer | None = None
        self._changed = threading.Event()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="tablet-screen", daemon=True)
        self._thread.start()

    def set_layer(self, layer: Layer | None) -> None:
        """Show this layer from now on; None turns the screen dark."""
        old, self._layer = self._layer, layer
        if old is not None:
            old.on_change = lambda: None
        if layer is not None:
            layer.on_change = self._changed.set
        self._changed.set()

    def set_background(self, colour: tuple[int, int, int]) -> None:
        """Set the colour around and behind pictures (RGB, 0 to 255)."""
        self._background = colour
        self._changed.set()

    def set_brightness(self, brightness: float) -> None:
        """Set how bright the screen is, 0 to 1; at 0 it can still be read."""
        self._brightness = brightness
        self._changed.set()

    def switch(self, on: bool) -> None:
        """Switch the screen on or off; what it shows stays."""
        self._on = on
        self._changed.set()

    def close(self) -> None:
        self._stop.set()
        self._changed.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            self._changed.wait()
            if self._stop.is_set():
                return
            begin = time.monotonic()
            self._changed.clear()
            try:
                self._draw()
            except Exception:  # top of a thread that decodes foreign pictures: the next one may be fine
                log.exception("the tablet's screen could not be drawn")
            self._stop.wait(PERIOD - (time.monotonic() - begin))

    def _draw(self) -> None:
        layer = self._layer if self._on else None
        if layer is None:
            self._show(None)
            self.image.put(np.zeros((SCREEN_HEIGHT, SCREEN_WIDTH, 3), np.uint8))
            return
        content, note = layer.content, layer.note
        if isinstance(content, bytes):
            try:
                picture = letterbox(decode(content, self._background), self._background)
            except ValueError as error:
                log.debug("the tablet shows no new picture: %s", error)
                return
        elif content is not None:
            picture = content.copy()
        else:
            picture = np.full((SCREEN_HEIGHT, SCREEN_WIDTH, 3), self._background, np.uint8)
        if note:
            _add_note(picture, note)
        if self._brightness < 1.0:
            share = _DIMMEST + (1.0 - _DIMMEST) * self._brightness
            np.multiply(picture, share, out=picture, casting="unsafe")
        picture.flags.writeable = False  # it has two owners now
        self._show(picture)
        self.image.put(picture)


def decode(data: bytes, background: tuple[int, int, int] = (0, 0, 0)) -> np.ndarray:
    """Decode a JPEG or PNG file to (height, width, 3) uint8 RGB, transparent parts over `background`.

    Raises:
        ValueError: It is neither, or damaged, or has more than `MAX_PIXELS`.
    """
    if not data.startswith(_PNG):
        return cv2.cvtColor(decode_jpeg(data, max_pixels=MAX_PIXELS), cv2.COLOR_BGR2RGB)
    width, height = _png_size(data)
    if not 0 < width * height <= MAX_PIXELS:
        raise ValueError(f"a picture of {width}x{height} pixels; at most {MAX_PIXELS} pixels are decoded")
    pixels: np.ndarray | None = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise ValueError(f"a damaged picture of {len(data)} bytes")
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    if pixels.ndim == 2:
        return cv2.cvtColor(pixels, cv2.COLOR_GRAY2RGB)
    if pixels.shape[2] == 4:
        alpha = pixels[:, :, 3:].astype(np.float32) / 255.0
        rgb = pixels[:, :, 2::-1] * alpha + np.array(background, np.float32) * (1.0 - alpha)
        return (rgb + 0.5).astype(np.uint8)
    return cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB)


def _png_size(data: bytes) -> tuple[int, int]:
    """Return the width and height that a PNG file claims. OpenCV makes room for as many bytes as a chunk says it has,
    gigabytes too, so each must end within the file.

    Raises:
        ValueError: A chunk goes on behind the end, or the last one is missing.
    """
    at, kind = len(_PNG), b""
    while kind != b"IEND":
        kind = data[at + 4 : at + 8]
        at += 12 + int.from_bytes(data[at : at + 4], "big")
        if at > len(data) or at < 24:  # the first one has the size
            raise ValueError(f"a damaged picture of {len(data)} bytes")
    width, height = struct.unpack(">II", data[16:24])
    return width, height


def letterbox(pixels: np.ndarray, background: tuple[int, int, int] = (0, 0, 0)) -> np.ndarray:
    """Return the whole picture, as large as possible, in the middle of a (400, 640, 3) screen."""
    height, width = pixels.shape[:2]
    scale = min(SCREEN_WIDTH / width, SCREEN_HEIGHT / height)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    if size != (width, height):
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    left, top = (SCREEN_WIDTH - size[0]) // 2, (SCREEN_HEIGHT - size[1]) // 2
    screen = np.empty((SCREEN_HEIGHT, SCREEN_WIDTH, 3), np.uint8)
    for bar in (screen[:top], screen[top + size[1] :], screen[:, :left], screen[:, left + size[0] :]):
        bar[:] = background
    screen[top : top + size[1], left : left + size[0]] = pixels
    return screen


def _add_note(picture: np.ndarray, note: str) -> None:
    """Write one line on a dark band at the bottom, and dim the picture above it to show that it is not live."""
    np.multiply(picture, 0.45, out=picture, casting="unsafe")
    picture[SCREEN_HEIGHT - 48 :] = picture[SCREEN_HEIGHT - 48 :] // 3
    while text_width(note, 12) > SCREEN_WIDTH - 40:
        note = note[:-5] + "..."
    write(picture, note, SCREEN_WIDTH // 2, SCREEN_HEIGHT - 30, 12, (255, 255, 255), align=0.5)
