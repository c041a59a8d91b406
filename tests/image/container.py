"""A running image, as a stranger runs it, and how a check says what it has found."""

from __future__ import annotations

import os
import re
import secrets
import shlex
import ssl
import subprocess
import threading
import time
import urllib.request
from collections.abc import Callable, Sequence

from free_ports import free_port

TOOL = os.environ.get("CONTAINER_TOOL", "podman")
BROWSERS = 4
"""UDP ports that are published for WebRTC."""


class Failed(Exception):
    """The image does not do what it should."""


def engine(*words: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run the engine; the caller looks at the answer."""
    return subprocess.run([TOOL, *words], capture_output=True, text=True, timeout=timeout)


wrong: list[str] = []
"""What is not as it should be."""


def say(what: str, fine: bool, figure: str = "") -> None:
    """Print one finding."""
    print(f"  {'✓' if fine else 'x'} {what}{': ' + figure if figure else ''}", flush=True)
    if not fine:
        wrong.append(what)


def wait_for(condition: Callable[[], object], timeout: float) -> float:
    """Wait until it holds; return after how many seconds. Raises Failed."""
    begin = time.monotonic()
    while not condition():
        if time.monotonic() - begin > timeout:
            raise Failed(f"not within {timeout:.0f} s: {(condition.__doc__ or condition.__name__).strip()}")
        time.sleep(0.1)
    return time.monotonic() - begin


class Container:
    """A running image.

    Args:
        image, arch: Which.
        words: What follows the image's name: arguments of `./stack`.
        options: Further options of the engine's `run`.
    """

    def __init__(self, image: str, arch: str, *words: str, options: Sequence[str] = ()) -> None:
        self.name = f"telepresence-test-{secrets.token_hex(4)}"
        self.port = free_port()
        first = free_port()
        udp = f"{first}-{first + BROWSERS - 1}"
        every = [
            "--name", self.name, "--hostname", "telepresence", "--platform", f"linux/{arch}", "--pull", "never",
            "--read-only", "--cap-drop", "all", "--security-opt", "no-new-privileges",
            "--volume", f"{self.name}:/var/lib/telepresence",
            "--publish", f"127.0.0.1:{self.port}:8443", "--env", f"TELEPRESENCE_PAGE_HOST=localhost:{self.port}",
            "--publish", f"127.0.0.1:{udp}:{udp}/udp", "--env", f"TELEPRESENCE_PAGE_UDP={udp}",
        ]  # fmt: skip
        if "docker" in TOOL:  # podman gives a read-only container a /tmp by itself
            every += ["--tmpfs", "/tmp"]
        every += [*shlex.split(os.environ.get("CONTAINER_RUN_OPTIONS", "")), *options]
        self.lines: list[str] = []
        self.complaint = ""
        """What its healthcheck said when it was last red: one line."""
        self.started = time.monotonic()
        self._run = subprocess.Popen(
            [TOOL, "run", *every, image, *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._run.stdout is not None
        for line in self._run.stdout:
            self.lines.append(line)

    @property
    def code(self) -> int | None:
        """How it ended; None while it runs."""
        return self._run.poll()

    def said(self, pattern: str) -> re.Match[str] | None:
        """Return where this stands in what it has printed. Raises Failed when it has ended without."""
        found = re.search(pattern, "".join(self.lines))
        if not found and self.code is not None:
            raise Failed("the container ended:\n" + "".join(self.lines[-40:]))
        return found

    def run(self, *words: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
        """Run a program in it."""
        return engine("exec", self.name, *words, timeout=timeout)

    def address(self) -> str:
        """its own address, which its engine gives it"""
        return engine("inspect", "--format", "{{.NetworkSettings.IPAddress}}", self.name).stdout.strip()

    def ros(self, *words: str) -> str:
        return self.run("/opt/telepresence/stack", "exec", *words).stdout

    def healthy(self) -> bool:
        """Whether its healthcheck is green: what the engine runs every few seconds, run now."""
        answer = self.run("python3", "-m", "telepresence.station.health")
        if answer.returncode:
            self.complaint = (answer.stdout.strip() or answer.stderr.strip()).rpartition("\n")[2]
        return answer.returncode == 0

    def kill(self, part: str, with_signal: str) -> None:
        """Send a signal to the program whose command line has `part`."""
        code = (
            "import os, signal, sys; from pathlib import Path\n"
            "for file in Path('/proc').glob('[0-9]*/cmdline'):\n"
            "    if sys.argv[1].encode() in file.read_bytes() and int(file.parent.name) != os.getpid():\n"
            "        os.kill(int(file.parent.name), getattr(signal, sys.argv[2]))\n"
            "        print(file.parent.name)\n"
        )
        if not self.run("python3", "-c", code, part, with_signal).stdout.strip():
            raise Failed(f"{part} does not run")

    def close(self) -> None:
        """Remove it with its volume."""
        engine("rm", "--force", "--volumes", self.name)
        engine("volume", "rm", self.name)
        self._run.wait(timeout=20.0)
        self._reader.join(timeout=5.0)


def reached(port: int) -> bool:
    """Whether the page answers at the published port."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # its own certificate
    try:
        urllib.request.urlopen(f"https://localhost:{port}/", timeout=2.0, context=context).close()
    except OSError:
        return False
    return True
