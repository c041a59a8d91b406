"""Links as QR codes, for phones that look at a screen."""

from __future__ import annotations

import qrcode
from qrcode.constants import ERROR_CORRECT_M

QUIET = 4
"""Modules of white around a code (ISO/IEC 18004)."""


def rows(text: str) -> list[str]:
    """Return the code of a text: a row of "1" for dark and "0" for light each, with its white edge."""
    code = qrcode.QRCode(error_correction=ERROR_CORRECT_M, border=QUIET)
    code.add_data(text)
    code.make(fit=True)
    return ["".join("1" if dark else "0" for dark in row) for row in code.get_matrix()]


def for_terminal(text: str) -> str:
    """Return the code as lines of half blocks, light on dark or dark on light: they set both colours."""
    lines = rows(text)
    if len(lines) % 2:
        lines.append("0" * len(lines[0]))
    blocks = {"00": " ", "01": "▄", "10": "▀", "11": "█"}
    pairs = zip(lines[::2], lines[1::2], strict=True)
    drawn = ("".join(blocks[up + down] for up, down in zip(*pair, strict=True)) for pair in pairs)
    return "\n".join(f"\033[30;107m{line}\033[0m" for line in drawn)
