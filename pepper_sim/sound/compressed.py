"""Compressed sound files, Ogg and MP3.

PyAV reads and writes them. It comes with the extra "media"; without it there are WAV files only.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

FORMATS = {".ogg": "ogg", ".mp3": "mp3"}
"""Suffix -> FFmpeg's container. The suffix decides: FFmpeg is not to guess, and to follow, a playlist."""
_FRAME = 0.02
"""Length of the pieces that the Opus codec takes [s]."""
_LAYOUTS = {1: "mono", 2: "stereo", 3: "3.0", 4: "quad"}


def read_compressed(path: Path) -> tuple[np.ndarray, int]:
    """Read an Ogg or MP3 file; return its samples, (n, channels) int16, and its rate [Hz].

    Raises:
        ValueError: It is no such file, or PyAV is not installed.
    """
    av = _library()
    try:
        with av.open(str(path), format=FORMATS[path.suffix.lower()], options={"protocol_whitelist": "file"}) as file:
            if not file.streams.audio:
                raise ValueError("the file holds no sound")
            resampler = av.AudioResampler(format="s16")
            pieces = [
                piece.to_ndarray().reshape(-1, piece.layout.nb_channels)
                for frame in [*file.decode(audio=0), None]
                for piece in resampler.resample(frame)
            ]
            rate = int(file.streams.audio[0].rate)
    except (av.FFmpegError, OSError) as error:
        raise ValueError(f"not a {path.suffix[1:]} file: {error}") from None
    if not pieces:
        raise ValueError("the file holds no sound")
    return np.concatenate(pieces), rate


def write_ogg(path: Path, samples: np.ndarray, rate: int) -> None:
    """Write (n, channels) int16 samples of 16000 or 48000 Hz as an Ogg file.

    Raises:
        ValueError: PyAV is not installed, or the file cannot be written.
    """
    av = _library()
    channels, count = samples.shape[1], round(_FRAME * rate)
    padded = np.concatenate([samples, np.zeros((-len(samples) % count, channels), np.int16)])
    try:
        with av.open(str(path), "w", format="ogg") as file:
            stream = file.add_stream("libopus", rate=rate, layout=_LAYOUTS[channels])
            for start in range(0, len(padded), count):
                piece = np.ascontiguousarray(padded[start : start + count]).reshape(1, -1)
                frame = av.AudioFrame.from_ndarray(piece, format="s16", layout=_LAYOUTS[channels])
                frame.sample_rate, frame.pts = rate, start
                file.mux(stream.encode(frame))
            file.mux(stream.encode(None))
    except (av.FFmpegError, OSError) as error:
        raise ValueError(f"'{path.name}' cannot be written: {error}") from None


def _library() -> Any:
    try:
        return importlib.import_module("av")
    except ImportError:
        raise ValueError("only WAV files can be used here: PyAV is not installed") from None
