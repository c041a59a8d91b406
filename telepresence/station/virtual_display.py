"""A virtual X display (Xvfb), and its picture. As a program it runs another one on a display of its own:

    python3 -m telepresence.station.virtual_display WIDTHxHEIGHT COMMAND ...

Xvfb writes its screen into a memory-mapped file (option -fbdir) in the XWD format of X11/XWDFile.h: 25 big-endian
32-bit words of header, the window's name, a colour map of 12 bytes per entry, then the rows.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from telepresence.station import processes

_HEADER = struct.Struct(">25I")


class VirtualDisplay:
    """An Xvfb on a free display number.

    Args:
        width, height: Size of the screen [px].
    Raises:
        RuntimeError: Xvfb is missing or ends at once.
    """

    def __init__(self, width: int = 1280, height: int = 720) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="telepresence-display-"))
        reader, writer = os.pipe()
        # -noreset: otherwise the server restarts when its last client leaves, and refuses new ones meanwhile.
        options = f"-screen 0 {width}x{height}x24 -nolisten tcp -noreset -fbdir {self.folder}"
        try:
            self._process = processes.start(
                f"Xvfb -displayfd {writer} {options}".split(),
                tied=True,
                stdin=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=[writer],
            )
        except FileNotFoundError:
            raise RuntimeError("Xvfb is not installed; run:  ./stack build") from None
        finally:
            os.close(writer)
        with os.fdopen(reader) as answer:
            number = answer.readline().strip()  # empty when Xvfb ends without a display
        if not number:
            raise RuntimeError("Xvfb could not open a display")
        self.name = f":{number}"
        """Value of the environment variable DISPLAY."""

    def close(self) -> None:
        processes.end(self._process)
        shutil.rmtree(self.folder, ignore_errors=True)


def grab(folder: Path) -> np.ndarray:
    """Return the present screen of the Xvfb that writes to `folder`: (height, width, 3) uint8, BGR.

    Raises:
        FileNotFoundError: No Xvfb writes there (any more).
    """
    screen = (folder / "Xvfb_screen0").read_bytes()
    header = _HEADER.unpack_from(screen)
    header_size, width, height, bytes_per_line, colours = header[0], header[4], header[5], header[12], header[19]
    rows = np.frombuffer(screen, np.uint8, bytes_per_line * height, header_size + 12 * colours)
    return rows.reshape(height, bytes_per_line)[:, : width * 4].reshape(height, width, 4)[:, :, :3]


def display_answers(name: str | None) -> bool:
    """Return whether an X server listens at this value of DISPLAY ("host:number.screen"; no host: this machine)."""
    host, colon, screen = (name or "").rpartition(":")
    if not colon or not screen.split(".")[0].isdigit():
        return False
    number = int(screen.split(".")[0])
    try:
        if host in ("", "unix"):
            with socket.socket(socket.AF_UNIX) as probe:
                probe.settimeout(2.0)
                probe.connect(f"/tmp/.X11-unix/X{number}")
        else:
            socket.create_connection((host, 6000 + number), timeout=2.0).close()
    except OSError:
        return False
    return True


def main() -> int:
    """Run a command on a display of its own, which is gone when it has ended; return its exit code."""
    width, height = map(int, sys.argv[1].split("x"))
    # roslaunch interrupts us and the command alike; the display stays until the command has ended.
    for request in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(request, lambda *_: None)
    display = VirtualDisplay(width, height)
    try:
        return subprocess.run(sys.argv[2:], env={**os.environ, "DISPLAY": display.name}).returncode
    finally:
        display.close()


if __name__ == "__main__":
    sys.exit(main())
