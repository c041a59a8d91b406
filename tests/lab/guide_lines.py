"""The command lines of docs/guides.md, typed into a terminal as a reader of a guide types them.

A table of that page has three columns: the folder to be in, the line, and what it prints. Texts in the last column
stand in the order in which they come; `…` stands for anything within a line. Words in capitals with an underscore are
the reader's to fill in.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "guides.md"
PATIENCE = 40.0
"""Seconds after which a text counts as never coming; generous, because the machines are shared."""


class GuideLine(NamedTuple):
    """One line of a table: where it is typed, what is typed, and the texts that it prints, in order."""

    folder: str
    line: str
    prints: tuple[str, ...]


def tables() -> dict[str, list[GuideLine]]:
    """Return the tables of lines by the heading above them."""
    found: dict[str, list[GuideLine]] = {}
    typed = PAGE.read_text().partition("## Every line, typed")[2]
    for section in re.split(r"^### ", typed, flags=re.MULTILINE)[1:]:
        heading, _, text = section.partition("\n")
        rows = [re.split(r"(?<!\\)\|", row.strip().strip("|")) for row in text.splitlines() if row.startswith("| `")]
        codes = [[re.findall(r"`([^`]+)`", cell.replace("\\|", "|")) for cell in row] for row in rows]
        found[heading.strip()] = [GuideLine(row[0][0], row[1][0], tuple(row[2])) for row in codes]
    return found


class Terminal:
    """A pseudo-terminal with one line in it; its keyboard and its screen."""

    def __init__(self, line: GuideLine, environment: Mapping[str, str], more: str, words: Mapping[str, str]) -> None:
        self.line = re.sub(r"\b[A-Z]{2,}_[A-Z_]+\b", lambda word: words.get(word[0], word[0]), f"{line.line} {more}")
        self._text = ""
        self._changed = threading.Condition()
        self._keyboard, inside = os.openpty()
        self._process = processes.start(
            ["setsid", "--ctty", "--wait", "bash", "-c", self.line],
            cwd=ROOT / line.folder.lstrip("/"),
            env={**environment, "TERM": "xterm", "PYTHONUNBUFFERED": "1"},
            stdin=inside,
            stdout=inside,
            stderr=inside,
        )
        os.close(inside)
        self._reader = threading.Thread(target=self._read, name="terminal", daemon=True)
        self._reader.start()

    @property
    def text(self) -> str:
        """What the screen shows, without colours."""
        return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", self._text).replace("\r", "")

    def press(self, keys: str) -> None:
        """Type keys."""
        os.write(self._keyboard, keys.encode())

    def wait_for(self, *texts: str, timeout: float = PATIENCE) -> None:
        """Return when the screen has shown these texts in this order.

        Raises:
            AssertionError: One has not come within `timeout` seconds, or the line has ended without it.
        """
        pattern = ".*".join(r"[^\n]*".join(map(re.escape, text.split("…"))) for text in texts)
        deadline = time.monotonic() + timeout
        with self._changed:
            while True:
                left, over = deadline - time.monotonic(), not self._reader.is_alive()
                if re.search(pattern, self.text, re.DOTALL):
                    return
                assert left > 0 and not over, (
                    f"{self.line}\n{'ended' if over else 'went on'} without {texts}:\n{self.text}"
                )
                self._changed.wait(min(left, 0.5))

    def close(self) -> None:
        """Press Ctrl-C, and end what does not end by that."""
        with contextlib.suppress(OSError):
            self.press("\x03")
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(20.0)
        for pid in (*processes.descendants(self._process.pid), self._process.pid):
            processes.send(pid, signal.SIGKILL)
        self._process.wait(10.0)
        os.close(self._keyboard)

    def _read(self) -> None:
        while True:
            try:
                data = os.read(self._keyboard, 65536)
            except OSError:
                data = b""
            with self._changed:
                self._text += data.decode(errors="replace")
                self._changed.notify_all()
            if not data:
                return


@contextlib.contextmanager
def typed(line: GuideLine, environment: Mapping[str, str], more: str = "", **words: str) -> Iterator[Terminal]:
    """Type a line, wait for what the page says that it prints, and end it by Ctrl-C after the block.

    Args:
        line: Its words in capitals are replaced.
        environment: Of the shell, which has read env.sh.
        more: Options that only a test needs, such as a free port.
        words: What to put in place of a word in capitals, for example `ROBOT_IP`.
    Raises:
        AssertionError: It does not print that.
    """
    terminal = Terminal(line, environment, more, words)
    try:
        terminal.wait_for(*line.prints)
        yield terminal
    finally:
        terminal.close()
