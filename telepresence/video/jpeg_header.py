"""What a JPEG file promises, read before it is decoded (ITU-T T.81, annex B). Standard library only.

A JPEG file says at its beginning how large the picture is, and a decoder believes it: 689 bytes can ask for gigabytes.
So whoever decodes a picture of a robot, a camera or a network reads the headers first, and decodes nothing but what
cameras send: Huffman coded, eight bits, grey or three colours, not too large, not in too many scans.
"""

from __future__ import annotations

from typing import NamedTuple

MAX_PIXELS = 1 << 23
"""Largest picture accepted [px]: a little more than 4K (3840x2160)."""
MAX_BYTES = 1 << 24
"""Largest JPEG file accepted [bytes]."""
MAX_SCANS = 16
"""Passes over the picture; what encoders make has one, or about ten if it is progressive."""
MAX_SEGMENTS = 200
"""Tables, comments and the like before the picture."""

_START, _BRAND = b"\xff\xd8\xff", b"ftyp"
_SCAN = 0xDA
_SCAN_MARKER = bytes((0xFF, _SCAN))
_PROGRESSIVE = 0xC2
_FRAMES = (0xC0, 0xC1, _PROGRESSIVE)
"""Start of frame: baseline, extended and progressive, by Huffman codes. Cameras send no other ones."""
_SEGMENTS = frozenset((*_FRAMES, 0xC4, 0xDB, 0xDD, *range(0xE0, 0xF0), 0xFE))
"""What may stand before a scan: frame, Huffman tables, quantisation tables, restart interval, applications, comment."""


class JpegHeader(NamedTuple):
    """What the headers of a JPEG file promise: size [pixel], number of colour components (1 or 3)."""

    width: int
    height: int
    components: int


def check_jpeg(data: bytes, max_pixels: int = MAX_PIXELS) -> JpegHeader:
    """Read the headers of a JPEG file; takes a few microseconds, whatever the file holds.

    Raises:
        ValueError: It is no JPEG, of a kind that no camera sends, larger than allowed, or smaller than a picture of its
            size can be.
    """
    # OpenCV would take a file with an AVIF brand behind its first segment's marker for AVIF.
    if not data.startswith(_START) or data[4:8] == _BRAND:
        raise ValueError(f"{len(data)} bytes that are no JPEG")
    if len(data) > MAX_BYTES:
        raise ValueError(f"a JPEG of {len(data)} bytes; {MAX_BYTES} are allowed")
    frame, progressive, at = None, False, 2
    for _ in range(MAX_SEGMENTS):
        if at + 5 > len(data) or data[at] != 0xFF:
            raise ValueError("a JPEG with damaged headers")
        marker = data[at + 1]
        if marker == 0xFF:  # a fill byte
            at += 1
            continue
        if marker == _SCAN:
            break
        if marker not in _SEGMENTS:
            raise ValueError(f"a JPEG with the marker {marker:#04x}, which no camera sends")
        length = data[at + 2] << 8 | data[at + 3]
        if length < 2 or at + 2 + length > len(data):
            raise ValueError("a JPEG with damaged headers")
        if marker in _FRAMES:
            if frame is not None:
                raise ValueError("a JPEG with two frames")
            frame = _read_frame(data[at + 4 : at + 2 + length], len(data), max_pixels)
            progressive = marker == _PROGRESSIVE
        at += 2 + length
    else:
        raise ValueError(f"a JPEG with more than {MAX_SEGMENTS} headers")
    if frame is None:
        raise ValueError("a JPEG without a frame")
    # Decoders read one scan of a sequential file if it has all components.
    if progressive or data[at + 4] != frame.components:
        scans = data.count(_SCAN_MARKER, at)  # in coded data 0xFF is followed by a zero: a marker is a marker
        if scans > MAX_SCANS:
            raise ValueError(f"a JPEG with {scans} scans; {MAX_SCANS} are allowed")
    return frame


def _read_frame(frame: bytes, file_size: int, max_pixels: int) -> JpegHeader:
    """Read a start of frame (T.81, B.2.2) without its marker and length.

    Raises:
        ValueError: It is damaged, or promises what is not decoded.
    """
    if len(frame) < 6 or len(frame) != 6 + 3 * frame[5]:
        raise ValueError("a JPEG with a damaged frame")
    height, width, components = frame[1] << 8 | frame[2], frame[3] << 8 | frame[4], frame[5]
    if frame[0] != 8 or components not in (1, 3):
        raise ValueError(f"a JPEG with {components} components of {frame[0]} bits; 1 or 3 of 8 are decoded")
    if not 0 < width * height <= max_pixels:
        raise ValueError(f"a JPEG of {width}x{height} pixels; {max_pixels} pixels are allowed")
    samplings = [(sampling >> 4, sampling & 15) for sampling in frame[7::3]]
    if not all(1 <= across <= 4 and 1 <= down <= 4 for across, down in samplings):
        raise ValueError("a JPEG with damaged sampling factors")
    most = max(across for across, _ in samplings) * max(down for _, down in samplings)
    # A block of 8x8 samples takes at least one bit.
    if width * height * sum(across * down for across, down in samplings) > 64 * 8 * file_size * most:
        raise ValueError(f"a JPEG of {width}x{height} pixels in {file_size} bytes, too few for so many")
    return JpegHeader(width, height, components)
