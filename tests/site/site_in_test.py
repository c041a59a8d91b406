"""A site that is tried: started as a person starts it, and what is found."""

from __future__ import annotations

import os
import re
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

from free_ports import free_port

from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 90.0
"""[s] for what has no promise of its own."""

wrong: list[str] = []
"""What is not as it should be."""
figures: dict[str, float] = {}
"""What was measured."""


class Failed(Exception):
    """The site does not do what it should."""


def say(what: str, fine: bool = True, figure: str = "") -> None:
    """Print one finding."""
    print(f"  {'✓' if fine else 'x'} {what}{': ' + figure if figure else ''}", flush=True)
    if not fine:
        wrong.append(what)


def wait_for(condition: Callable[[], object], what: str, timeout: float = PATIENCE) -> float:
    """Wait until it holds; return after how many seconds. Raises Failed."""
    begin = time.monotonic()
    while not condition():
        if time.monotonic() - begin > timeout:
            raise Failed(f"{what}: not within {timeout:.0f} s")
        time.sleep(0.02)
    return time.monotonic() - begin


class RunningSite:
    """`./stack site up`, and what it prints.

    Args:
        folder: The home of whoever starts it.
        robots: Further lines of its file.
    """

    def __init__(self, folder: Path, robots: str) -> None:
        self.port = free_port()
        file = folder / "site.toml"
        file.write_text(f'port = {self.port}\nlogs = "{folder}/logs"\n{robots}')
        environment = {**os.environ, "HOME": str(folder), "TELEPRESENCE_AS_ROOT": "1"}
        environment["TELEPRESENCE_USERS"] = str(folder / "users.db")
        environment.pop("DISPLAY", None)
        self.logs = folder / "logs"
        self.lines: list[str] = []
        self.started = time.monotonic()
        self.process = processes.start(
            [str(ROOT / "stack"), "site", "up", str(file)],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line)

    def said(self, pattern: str, count: int = 1) -> bool:
        """Whether it has printed that so often."""
        if self.process.poll() is not None:
            raise Failed("the site ended:\n" + "".join(self.lines[-20:]))
        return len(re.findall(pattern, "".join(self.lines), re.M)) >= count

    @property
    def link(self) -> str:
        found = re.search(r"robots +(https://\S+)", "".join(self.lines))
        assert found
        return found[1]

    def unit(self, name: str) -> int:
        """Return the process id of a unit."""
        wanted = f"/{name}.socket"
        (pid,) = (pid for pid in self._tree() if "telepresence.station" in command(pid) and wanted in command(pid))
        return pid

    @property
    def proxy(self) -> int:
        (pid,) = (pid for pid in self._tree() if command(pid).startswith("caddy "))
        return pid

    def _tree(self) -> list[int]:
        return processes.descendants(self.process.pid)


def command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""
