"""A virtual X display (Xvfb), and its picture. As a program it runs another one on a display of its own:

    python3 -m telepresence.station.virtual_display WIDTHxHEIGHT COMMAND ...

Whoever connects to an X display can take its picture and type into its terminals, and without a cookie every user of
the machine may. So there is one, of 128 random bits, in a file that only the owner can read (XAUTHORITY; Xau(3)).

Xvfb writes its screen into a memory-mapped file (option -fbdir) in the XWD format of X11/XWDFile.h: 25 big-endian
32-bit words of header, the window's name, a colour map of 12 bytes per entry, then the rows.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import signal
import socket
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from telepresence.station import processes, program_registry, vitals
from telepresence.station.absence import goes_on
from telepresence.station.adopted import Adopted
from telepresence.station.program_registry import Running
from telepresence.temporary_folder import TemporaryFolder

if TYPE_CHECKING:
    import numpy as np

PREFIX = "telepresence-display-"
"""How the names of the displays' folders begin."""
PROGRAM = "Xvfb"
NUMBER = "number"
"""File in such a folder with the display's number: X servers that are killed leave files elsewhere."""
_X_LOCK, _X_SOCKET = "/tmp/.X{}-lock", "/tmp/.X11-unix/X{}"
_HEADER = struct.Struct(">25I")
_ANY_DISPLAY = 0xFFFF
"""FamilyWild of X11/Xauth.h: the cookie is for whatever display its reader connects to, as the display's number is not
known before the X server has read the file."""


class VirtualDisplay:
    """An Xvfb on a free display number.

    Args:
        width, height: Size of the screen [px].
        opengl: Whether programs there can use OpenGL, for which Xvfb loads a compiler of 40 MB.
        left: The folder of a display whose owner has died. It is taken over, and started again if it has ended.
    Raises:
        RuntimeError: Xvfb is missing or ends at once.
        OSError: The one that was left cannot be taken over.
    """

    process: subprocess.Popen | Adopted

    def __init__(self, width: int = 1280, height: int = 720, opengl: bool = True, left: Path | None = None) -> None:
        self._extensions = "" if opengl else "-extension GLX"
        self._size = f"{width}x{height}x24"
        self._folder = TemporaryFolder(PREFIX, remove_elsewhere, left)
        self.folder = self._folder.path
        self.authority = self.folder / "Xauthority"
        """Value of the environment variable XAUTHORITY."""
        if left is None:
            write_cookie(self.authority)
            number = self._run()
            (self.folder / NUMBER).write_text(number, encoding="ascii")
        else:
            number = (left / NUMBER).read_text(encoding="ascii")
            self._adopt(number)
        self.name = f":{number}"
        """Value of the environment variable DISPLAY."""

    def _adopt(self, number: str) -> None:
        """Go on with the Xvfb of this display, or start one."""
        known = program_registry.recall(self.folder, PROGRAM)
        with contextlib.suppress(ProcessLookupError):
            if known is not None and known.lives:
                self.process = Adopted(known.pid)
                return
        self._run(number)

    def _run(self, number: str = "") -> str:
        """Start Xvfb, on a free display unless its number is given; return the number."""
        reader, writer = os.pipe()
        # -noreset: otherwise the server restarts when its last client leaves, and refuses new ones meanwhile.
        options = f"-screen 0 {self._size} -nolisten tcp -noreset {self._extensions}"
        display = f":{number}" if number else ""
        with tempfile.TemporaryFile("w+", errors="replace") as said:
            try:
                self.process = processes.start(
                    f"Xvfb {display} -displayfd {writer} {options} -fbdir {self.folder} -auth {self.authority}".split(),
                    tied=not goes_on(),
                    stdin=subprocess.DEVNULL,
                    stderr=said,
                    pass_fds=[writer],
                    umask=0o077,
                )
            except FileNotFoundError:
                raise RuntimeError("Xvfb is not installed; run:  ./stack build") from None
            finally:
                os.close(writer)
            with os.fdopen(reader) as answer:
                number = answer.readline().strip()  # empty when Xvfb ends without a display
            if not number:
                said.seek(0)
                raise RuntimeError(f"Xvfb could not open a display: {_last_words(said.read())}")
        pid = self.process.pid
        program_registry.remember(self.folder, Running(PROGRAM, pid, vitals.start_time(pid), []))
        return number

    def start_again(self) -> None:
        """Start Xvfb anew after it has ended: the same display, and nobody's windows on it.

        Raises:
            RuntimeError: It ends at once.
        """
        self._run(self.name.removeprefix(":"))

    @property
    def environment(self) -> dict[str, str]:
        """What a program needs in its environment to open windows here."""
        return {"DISPLAY": self.name, "XAUTHORITY": str(self.authority)}

    def close(self) -> None:
        processes.end(self.process)
        self._folder.close()


def remove_elsewhere(folder: Path) -> None:
    """Remove the lock and the socket of a display whose X server was killed. Args: folder: Of the display."""
    try:
        number = (folder / NUMBER).read_text().strip()
    except FileNotFoundError:
        return
    if number.isdecimal() and not _x_server_lives(number):
        for name in (_X_LOCK, _X_SOCKET):
            Path(name.format(number)).unlink(missing_ok=True)


def _x_server_lives(number: str) -> bool:
    """Whether the process that has locked this display number exists (X servers write their process id)."""
    try:
        pid = int(Path(_X_LOCK.format(number)).read_text())
        os.kill(pid, 0)
    except (FileNotFoundError, ProcessLookupError):
        return False
    except (ValueError, PermissionError):
        return True  # somebody else's by now
    return True


def write_cookie(path: Path) -> None:
    """Write a new X authority file with one random MIT-MAGIC-COOKIE-1, which only this user can read.

    Raises:
        FileExistsError: There is something at `path` already, were it a link.
    """
    fields = (b"", b"", b"MIT-MAGIC-COOKIE-1", secrets.token_bytes(16))  # address, display, protocol, cookie
    entry = struct.pack(">H", _ANY_DISPLAY) + b"".join(struct.pack(">H", len(field)) + field for field in fields)
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(entry)


def grab(folder: Path) -> np.ndarray:
    """Return the present screen of the Xvfb that writes to `folder`: (height, width, 3) uint8, BGR.

    Raises:
        FileNotFoundError: No Xvfb writes there (any more).
    """
    import numpy as np  # only who looks at the screen needs it, and it takes a third of the time to start

    screen = (folder / "Xvfb_screen0").read_bytes()
    header = _HEADER.unpack_from(screen)
    header_size, width, height, bytes_per_line, colours = header[0], header[4], header[5], header[12], header[19]
    rows = np.frombuffer(screen, np.uint8, bytes_per_line * height, header_size + 12 * colours)
    return rows.reshape(height, bytes_per_line)[:, : width * 4].reshape(height, width, 4)[:, :, :3]


def _last_words(said: str) -> str:
    """The line after which Xvfb ends, or the last one that has words."""
    lines = [line.replace("(EE)", "").strip() for line in said.splitlines()]
    lines = [line for line in lines if line] or ["it says nothing"]
    fatal = "Fatal server error:"
    return lines[lines.index(fatal) + 1] if fatal in lines[:-1] else lines[-1]


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
                probe.connect(_X_SOCKET.format(number))
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
        return subprocess.run(sys.argv[2:], env={**os.environ, **display.environment}).returncode
    finally:
        display.close()


if __name__ == "__main__":
    sys.exit(main())
