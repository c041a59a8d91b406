"""A time drawn into the pixels of a picture, so that its age can be measured wherever it arrives.

Forty blocks, black or white, in two rows at the lower edge: 32 bits of a clock in steps of 0.1 ms, which wraps
every five days, and 8 bits that check them, most significant first. Blocks survive compression that digits would not.
The clock is the machine's time of day: between two machines the age is as good as their clocks agree.
"""

from __future__ import annotations

import zlib

import numpy as np

COLUMNS, ROWS = 20, 2
STEP = 1e-4
"""Step of the clock [s]."""
BLACK, WHITE = 16, 235
_VALUE_BITS, _CHECK_BITS = 32, 8
_ROUND = 1 << _VALUE_BITS


def strip_height(width: int) -> int:
    """Return the height of the blocks in a picture of this width [pixel]; even, because colours have half the size."""
    return ROWS * 2 * max(2, width // COLUMNS // 4)


def draw_time(pixels: np.ndarray, time: float) -> None:
    """Draw a time into a picture, in place.

    Args:
        pixels: (height, width) luma or (height, width, 3) uint8; at least 80 x 8 pixels.
        time: [s since 1970].
    Raises:
        ValueError: The picture is too small.
    """
    height, width = pixels.shape[:2]
    strip = strip_height(width)
    if width < 4 * COLUMNS or height < strip:
        raise ValueError(f"a picture of {width} x {height} is too small for a time; expected at least 80 x 8 pixels")
    value = int(time / STEP) % _ROUND
    word = value << _CHECK_BITS | _check(value)
    bits = [word >> (_VALUE_BITS + _CHECK_BITS - 1 - i) & 1 for i in range(_VALUE_BITS + _CHECK_BITS)]
    colours = np.where(np.array(bits, bool).reshape(ROWS, COLUMNS), WHITE, BLACK).astype(np.uint8)
    block = width // COLUMNS
    blocks = colours.repeat(strip // ROWS, axis=0).repeat(block, axis=1)
    pixels[height - strip :, : COLUMNS * block] = blocks if pixels.ndim == 2 else blocks[:, :, None]


def read_age(pixels: np.ndarray, now: float) -> float | None:
    """Return the seconds since the time drawn into a picture; None if it contains none that can be read.

    Args:
        pixels: (height, width) or (height, width, 3) uint8, as it arrived.
        now: [s since 1970]. Slightly negative ages are clocks that disagree.
    """
    height, width = pixels.shape[:2]
    strip = strip_height(width)
    if width < 4 * COLUMNS or height < strip:
        return None
    block, row = width // COLUMNS, strip // ROWS
    area = pixels[height - strip :, : COLUMNS * block]
    area = area if area.ndim == 2 else area[:, :, 1]
    # The middle of each block: its edges are blurred.
    middles = area.reshape(ROWS, row, COLUMNS, block)[:, row // 4 : row - row // 4, :, block // 4 : block - block // 4]
    word = 0
    for bit in (middles.mean(axis=(1, 3)) > 128).ravel():
        word = word << 1 | int(bit)
    value = word >> _CHECK_BITS
    if word & ((1 << _CHECK_BITS) - 1) != _check(value):
        return None
    ticks = (int(now / STEP) - value) % _ROUND
    return (ticks - _ROUND if ticks >= _ROUND // 2 else ticks) * STEP


def _check(value: int) -> int:
    # Inverted, so that neither a black nor a white strip is a time.
    return ~zlib.crc32(value.to_bytes(4, "big")) & 0xFF
