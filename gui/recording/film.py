"""A film of a robot's pictures: H.264 in an MP4 file, each picture at the time when it was taken. No ROS, no Qt."""

from __future__ import annotations

import math
import os
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from telepresence.security import private_files

TIME_BASE = Fraction(1, 1000)
"""Unit of the time stamps in the file [s]."""
KEY_FRAME_EVERY = 30
"""Pictures between two that stand alone; a film whose writer was killed lacks what came after the last of them."""
OPTIONS = {"preset": "veryfast", "tune": "zerolatency", "crf": "23", "g": str(KEY_FRAME_EVERY)}


CLOCK_SET_BACK = 1.0
"""[s] by which a picture seems older than the one before when the clock was set back: the film goes on."""
NEXT = 0.1
"""[s] between those two pictures in the film."""


class Film:
    """Writes one film. The size is that of the first picture, rounded down to even numbers; others are scaled to it.

    The file is complete up to the last key frame at any time (fragmented MP4), even if this process is killed.

    Args:
        path: The file; it is made with the first picture.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.pictures = 0
        """How many were written."""
        self._container: av.container.OutputContainer | None = None
        self._stream: av.VideoStream | None = None
        self._start = 0.0
        self._newest = -math.inf
        self._last = -1

    def add(self, pixels: np.ndarray, stamp: float) -> bool:
        """Add a picture, unless it is not newer than the last one; return whether it was added.

        Args:
            pixels: (height, width, 3) uint8, BGR, or (height, width) uint8, grey.
            stamp: When it was taken [s].
        Raises:
            OSError: The file cannot be written.
            ValueError: The picture is smaller than 2x2 pixels.
        """
        if self._stream is None:
            self._open(pixels.shape[1] // 2 * 2, pixels.shape[0] // 2 * 2, stamp)
        assert self._stream is not None and self._container is not None  # `_open` makes them
        if stamp < self._newest - CLOCK_SET_BACK:
            self._start -= self._newest - stamp + NEXT
        self._newest = stamp
        when = round((stamp - self._start) / TIME_BASE)
        if when <= self._last:
            return False
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), "bgr24" if pixels.ndim == 3 else "gray")
        frame = frame.reformat(self._stream.width, self._stream.height, "yuv420p")
        frame.pts, frame.time_base = when, TIME_BASE
        self._container.mux(self._stream.encode(frame))
        self._last = when
        self.pictures += 1
        return True

    def close(self) -> None:
        """Finish the file."""
        if self._container is not None and self._stream is not None:
            self._container.mux(self._stream.encode())
            self._container.close()
            self._container = self._stream = None

    def _open(self, width: int, height: int, stamp: float) -> None:
        if width < 2 or height < 2:
            raise ValueError(f"a film needs pictures of at least 2x2 pixels, got {width}x{height}")
        # Made here, so that nobody else can read it, and no link at its place is followed.
        os.close(private_files.open_file(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC))
        self._container = av.open(
            str(self.path), "w", format="mp4",
            options={"movflags": "frag_keyframe+empty_moov+default_base_moof", "fflags": "+flush_packets"},
        )  # fmt: skip
        self._stream = self._container.add_stream("libx264", options=OPTIONS)
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        self._stream.codec_context.time_base = TIME_BASE
        self._start = stamp
