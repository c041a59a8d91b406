"""Another user of the pilot's computer, and the virtual display on which the window stands where there is no screen."""

from __future__ import annotations

import os
import secrets
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from telepresence.station import processes

pytestmark = pytest.mark.x11

STRANGER = 65534
"""User id of "nobody" on Debian."""
ACCEPTED = 1
"""First byte of the X server's answer to whoever may connect (X11 protocol, "connection setup")."""


class Display:
    """A virtual display as the station starts it, with a terminal in it that keeps what is typed."""

    def __init__(self, folder: Path, wait_until: Callable) -> None:
        said, self.typed = folder / "display", folder / "typed"
        terminal = f"echo $DISPLAY >{said}.new; mv {said}.new {said}; exec cat >{self.typed}"
        words = [sys.executable, "-m", "telepresence.station.virtual_display", "320x240"]
        self.program = processes.start([*words, "xterm", "-e", "sh", "-c", terminal], stderr=subprocess.DEVNULL)
        wait_until(said.exists, "the terminal is open")
        self.name = said.read_text().strip()
        pids = processes.descendants(self.program.pid)
        words = next(w for w in map(_words, pids) if w[0] == "Xvfb")
        self.folder = Path(words[words.index("-fbdir") + 1])
        server = next(pid for pid in pids if _words(pid)[0] == "xterm")
        own = dict(entry.split("=", 1) for entry in _lines(server, "environ") if "=" in entry)
        self.owner = {name: own[name] for name in ("DISPLAY", "XAUTHORITY") if name in own}

    def as_stranger(self, *words: str) -> subprocess.CompletedProcess:
        """Run a program as another user of the machine; where the tests are no root, as one who lacks the cookie."""
        identity = {"user": STRANGER, "group": STRANGER, "extra_groups": []} if os.geteuid() == 0 else {}
        environment = {"PATH": os.environ["PATH"], "DISPLAY": self.name, "HOME": "/nonexistent"}
        return subprocess.run(words, env=environment, cwd="/", capture_output=True, timeout=30, **identity)

    def setup(self, address: str, protocol: bytes = b"", cookie: bytes = b"") -> int:
        """Greet the X server as a client does, and return the first byte of its answer."""
        greeting = struct.pack("<BxHHHHxx", ord("l"), 11, 0, len(protocol), len(cookie))
        padded = (field.ljust(-(-len(field) // 4) * 4, b"\0") for field in (protocol, cookie))
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(10.0)
            client.connect(address)
            client.sendall(greeting + b"".join(padded))
            return client.recv(1)[0]

    @property
    def socket(self) -> str:
        return f"/tmp/.X11-unix/X{self.name[1:]}"


def _lines(pid: int, file: str) -> list[str]:
    return Path(f"/proc/{pid}/{file}").read_bytes().decode().split("\0")


def _words(pid: int) -> list[str]:
    return _lines(pid, "cmdline")


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory, wait_until: Callable) -> Iterator[Display]:
    display = Display(tmp_path_factory.mktemp("display"), wait_until)
    yield display
    for pid in processes.descendants(display.program.pid):
        if _words(pid)[0] == "cat":  # the terminal ends with what runs in it, and the display with the terminal
            processes.send(pid, signal.SIGTERM)
    display.program.wait(15)


def type_into_terminal(run: Callable[..., object], text: str) -> None:
    for words in (("mousemove", "100", "100"), ("type", "--delay", "5", text), ("key", "Return")):
        run("xdotool", *words)


def test_the_owner_sees_and_types(display, wait_until):
    """No attack: it shows that the others fail for want of the cookie and not for another reason."""
    environment = {**os.environ, **display.owner}

    def run(*words: str) -> bytes:
        return subprocess.run(words, env=environment, capture_output=True, check=True, timeout=30).stdout

    assert run("import", "-window", "root", "ppm:-")[:2] == b"P6"
    type_into_terminal(run, "mine")
    wait_until(lambda: "mine" in display.typed.read_text(), "the owner's letters have arrived")


def test_another_user_takes_a_screenshot(display):
    """It must fail, and bring no picture."""
    taken = display.as_stranger("import", "-window", "root", "ppm:-")
    assert taken.returncode != 0 and not taken.stdout


def test_another_user_types_into_the_terminal(display, wait_until):
    type_into_terminal(display.as_stranger, "stranger")
    environment = {**os.environ, **display.owner}
    # What the owner types afterwards arrives: the terminal was ready for the stranger's letters, too.
    type_into_terminal(lambda *words: subprocess.run(words, env=environment, check=True, timeout=30), "end")
    wait_until(lambda: "end" in display.typed.read_text(), "the owner's letters have arrived")
    assert "stranger" not in display.typed.read_text()


@pytest.mark.parametrize("kind", ["file", "abstract"])
def test_a_client_without_a_cookie_connects(display, kind):
    """Both sockets of an X server on Linux, the one in /tmp and the one with an abstract name."""
    assert display.setup(display.socket if kind == "file" else "\0" + display.socket) != ACCEPTED


def test_a_client_with_a_wrong_cookie_connects(display):
    assert display.setup(display.socket, b"MIT-MAGIC-COOKIE-1", secrets.token_bytes(16)) != ACCEPTED


@pytest.mark.parametrize("name", ["Xvfb_screen0", "Xauthority"])
def test_another_user_reads_a_file_of_the_display(display, name):
    """The screen as a file, and the cookie."""
    if os.geteuid() == 0:
        assert display.as_stranger("head", "-c1", str(display.folder / name)).returncode != 0
    assert not display.folder.stat().st_mode & 0o077, "what protects them from every other user"
