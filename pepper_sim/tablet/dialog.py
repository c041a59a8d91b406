"""The tablet's own windows over everything else: a question with a line to type into, and a coloured cover."""

from __future__ import annotations

import numpy as np

from pepper_sim.body.description import SCREEN_HEIGHT, SCREEN_WIDTH
from telepresence.video.draw_text import write

_INK, _GREY, _LINE = (33, 33, 33), (120, 120, 120), (0, 121, 107)
_BOX = (80, 90, SCREEN_WIDTH - 80, SCREEN_HEIGHT - 90)
"""Left, top, right, bottom [px]."""


def draw_dialog(title: str, text: str, confirm: str, cancel: str) -> np.ndarray:
    """Draw a question with an input line and two buttons, (400, 640, 3) uint8 RGB."""
    screen = np.full((SCREEN_HEIGHT, SCREEN_WIDTH, 3), 60, np.uint8)
    left, top, right, bottom = _BOX
    screen[top:bottom, left:right] = 255
    write(screen, title[:120], left + 24, top + 28, 15, _INK, weight=1.5, width=right - left - 48)
    write(screen, text[:80], left + 24, top + 100, 13, _INK)
    screen[top + 126 : top + 128, left + 24 : right - 24] = _LINE
    write(screen, cancel[:20], left + (right - left) // 4, bottom - 40, 13, _GREY, align=0.5)
    write(screen, confirm[:20], left + 3 * (right - left) // 4, bottom - 40, 13, _LINE, weight=1.5, align=0.5)
    return screen


def covered(screen: np.ndarray, colour: tuple[int, int, int], opacity: float) -> np.ndarray:
    """Return a screen behind a colour, which hides it at opacity 1."""
    mixed = screen * (1.0 - opacity) + np.array(colour) * opacity
    return mixed.round().astype(np.uint8)
