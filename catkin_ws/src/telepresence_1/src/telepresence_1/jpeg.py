"""Pictures that a camera has encoded itself: made complete, so that they can be passed on without decoding them.

Motion JPEG leaves two things to its reader: behind the picture the buffer may go on with anything, and the Huffman
tables may be missing, for they are always those of the JPEG standard (ITU-T T.81, annex K.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from telepresence.video.jpeg_header import check_jpeg

_START, _END, _SCAN, _TABLES = b"\xff\xd8", b"\xff\xd9", b"\xff\xda", b"\xff\xc4"


@dataclass(frozen=True)
class Jpeg:
    """A complete JPEG file of a picture of `width` x `height` pixels."""

    data: bytes
    width: int
    height: int


def completed(data: bytes) -> Jpeg | None:
    """The picture at the start of a camera's buffer; None when there is none that `check_jpeg` lets pass, or its end is
    missing."""
    end = data.rfind(_END)
    if not data.startswith(_START) or end < 0:
        return None
    # Headers have no escapes: before the scan, a marker is a marker or lies within a table, where it does no harm.
    head = data[: data.find(_SCAN) + 1]
    tables = b"" if _TABLES in head else _STANDARD_TABLES
    whole = _START + tables + data[len(_START) : end + len(_END)]
    try:
        header = check_jpeg(whole)
    except ValueError:
        return None
    return Jpeg(whole, header.width, header.height)


def _standard_tables() -> bytes:
    """The Huffman segments as OpenCV writes them, which are the standard's unless its option to optimise them is on."""
    _, encoded = cv2.imencode(".jpg", np.zeros((8, 8, 3), np.uint8))
    data, segments, at = encoded.tobytes(), b"", len(_START)
    while data[at : at + 2] != _SCAN:
        length = 2 + int.from_bytes(data[at + 2 : at + 4], "big")
        if data[at : at + 2] == _TABLES:
            segments += data[at : at + length]
        at += length
    return segments


_STANDARD_TABLES = _standard_tables()
