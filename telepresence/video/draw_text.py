"""Text in pictures, with OpenCV's stroke font: no font file, no second image library.

The strokes are drawn at several times the size and averaged down, which makes them as smooth as a text renderer's.
"""

from __future__ import annotations

import unicodedata

import cv2
import numpy as np

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_CAP_HEIGHT = 21.0  # of this font at scale 1 [pixel]
_FINENESS = 4
_LEADING = 1.75  # line distance in cap heights
_ADVANCE = {c: cv2.getTextSize(c, _FONT, 1.0, 1)[0][0] - 1 for c in map(chr, range(32, 127))}  # at scale 1 [pixel]
_PLAIN = str.maketrans("–—‘’“”«»„", '--\'\'"""""')

Colour = tuple[int, int, int]


def text_width(text: str, size: float, weight: float = 1.0) -> int:
    """Return the width of one line [pixel] in capitals `size` pixels high; `weight` as for `write`."""
    return round(_advance(_plain(text)) * size / _CAP_HEIGHT + _stroke(size, weight) / _FINENESS)


def wrap(text: str, size: float, width: int, weight: float = 1.0) -> list[str]:
    """Break the text into lines of at most `width` pixels, at blanks, and inside a word only if it is too long."""
    room = (width - _stroke(size, weight) / _FINENESS) * _CAP_HEIGHT / size
    lines: list[str] = []
    line, used = "", 0
    for word in _plain(text).split():
        taken = _advance(word)
        if line and used + _ADVANCE[" "] + taken <= room:
            line, used = f"{line} {word}", used + _ADVANCE[" "] + taken
            continue
        if line:
            lines.append(line)
        line, used = "", 0
        for letter in word:
            if line and used + _ADVANCE[letter] > room:
                lines.append(line)
                line, used = "", 0
            line, used = line + letter, used + _ADVANCE[letter]
    return [*lines, line] if line else lines


def write(
    pixels: np.ndarray,
    text: str,
    left: int,
    top: int,
    size: float,
    colour: Colour,
    *,
    weight: float = 1.0,
    width: int | None = None,
    align: float = 0.0,
) -> int:
    """Write on a picture, in place, and return the top of the line that would follow.

    Args:
        pixels: (height, width, 3) uint8; what falls outside is cut off.
        text: Accents are dropped, signs outside ASCII become "?".
        left, top: Upper left corner of the first line's capitals [pixel].
        size: Height of a capital letter [pixel].
        colour: In the picture's own order of channels.
        weight: Of the strokes; 1 regular, 1.6 bold.
        width: Break lines at this width [pixel]; None: one line.
        align: 0 left, 0.5 centred, 1 right within `width`, or about `left` without one.
    """
    lines = wrap(text, size, width, weight) if width else [_plain(text)]
    for line in lines:
        spare = (width or 0) - text_width(line, size, weight)
        _blend(pixels, line, round(left + spare * align), top, size, colour, weight)
        top += round(size * _LEADING)
    return top


def _blend(pixels: np.ndarray, line: str, left: int, top: int, size: float, colour: Colour, weight: float) -> None:
    margin = round(size * 0.6)
    height, width = round(size) + 2 * margin, text_width(line, size, weight) + 2 * margin
    strokes = np.zeros((height * _FINENESS, width * _FINENESS), np.uint8)
    origin = (margin * _FINENESS, round((margin + size) * _FINENESS))
    scale = size / _CAP_HEIGHT * _FINENESS
    cv2.putText(strokes, line, origin, _FONT, scale, 255, _stroke(size, weight), cv2.LINE_AA)
    cover = cv2.resize(strokes, (width, height), interpolation=cv2.INTER_AREA)
    x0, y0 = left - margin, top - margin
    x1, y1 = max(x0, 0), max(y0, 0)
    x2, y2 = min(x0 + width, pixels.shape[1]), min(y0 + height, pixels.shape[0])
    if x1 >= x2 or y1 >= y2:
        return
    alpha = cover[y1 - y0 : y2 - y0, x1 - x0 : x2 - x0, None].astype(np.float32) / 255.0
    area = pixels[y1:y2, x1:x2]
    area[:] = (area + (np.array(colour, np.float32) - area) * alpha + 0.5).astype(np.uint8)


def _advance(text: str) -> int:
    return sum(_ADVANCE[letter] for letter in text)


def _stroke(size: float, weight: float) -> int:
    return max(1, round(size * _FINENESS * 0.11 * weight))


def _plain(text: str) -> str:
    decomposed = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    letters = (c for c in decomposed if not unicodedata.combining(c))
    return "".join(c if " " <= c <= "~" else " " if c.isspace() else "?" for c in letters)
