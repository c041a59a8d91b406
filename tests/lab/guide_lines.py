"""The command lines of docs/guides.md and docs/origins.md, typed into a terminal as their readers type them.

A table of these pages has three columns: the folder to be in, the line, and what it prints. Texts in the last column
stand in the order in which they come; `…` stands for anything within a line. Words in capitals with an underscore are
the reader's to fill in.
"""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from telepresence_ros.pseudo_terminal import Terminal

from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "guides.md"
LAST_WORDS = 1.0
"""[s] until what a program has printed before it ended is read."""
PATIENCE = 40.0
"""Seconds after which a text counts as never coming; generous, because the machines are shared."""

WORD = re.compile(r"\b[A-Z]+_[A-Z_]+\b")
COLOURS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class GuideLine(NamedTuple):
    """One line of a table: where it is typed, what is typed, and the texts that it prints, in order."""

    folder: str
    line: str
    prints: tuple[str, ...]


def tables(page: Path = PAGE, part: str = "## Every line, typed") -> dict[str, list[GuideLine]]:
    """Return the tables of lines in this part of a page by the heading above them."""
    found: dict[str, list[GuideLine]] = {}
    typed = page.read_text().partition(part)[2].partition("\n## ")[0]
    for section in re.split(r"^### ", typed, flags=re.MULTILINE)[1:]:
        heading, _, text = section.partition("\n")
        rows = [re.split(r"(?<!\\)\|", row.strip().strip("|")) for row in text.splitlines() if row.startswith("| `")]
        codes = [[re.findall(r"`([^`]+)`", cell.replace("\\|", "|")) for cell in row] for row in rows]
        found[heading.strip()] = [GuideLine(row[0][0], row[1][0], tuple(row[2])) for row in codes]
    return found


def wait_for(terminal: Terminal, *texts: str, timeout: float = PATIENCE) -> None:
    """Return when a terminal has shown these texts in this order.

    Raises:
        AssertionError: One has not come within `timeout` seconds, or the program has ended without it.
    """
    pattern = re.compile(".*".join(r"[^\n]*".join(map(re.escape, text.split("…"))) for text in texts), re.DOTALL)
    deadline, ended = time.monotonic() + timeout, False
    while True:
        left, over = deadline - time.monotonic(), terminal.process.poll() is not None
        shown = COLOURS.sub("", terminal.seen).replace("\r", "")
        if pattern.search(shown):
            return
        line = terminal.process.args
        if over and not ended:  # its last words are still being read
            ended, deadline = True, min(deadline, time.monotonic() + LAST_WORDS)
        assert left > 0, f"{line} {'ended' if over else 'went on'} without {texts}:\n{shown}"
        time.sleep(0.05)


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
    text = WORD.sub(lambda word: words.get(word[0], word[0]), f"{line.line} {more}")
    terminal = Terminal(
        "bash", "-c", text, cwd=ROOT / line.folder.lstrip("/"), env={**environment, "PYTHONUNBUFFERED": "1"}
    )
    try:
        wait_for(terminal, *line.prints)
        yield terminal
    finally:
        _end(terminal)


def _end(terminal: Terminal) -> None:
    """Press Ctrl-C, and end what does not end by that."""
    terminal.type("\x03")
    with contextlib.suppress(subprocess.TimeoutExpired):
        terminal.process.wait(20.0)
    for pid in processes.descendants(terminal.process.pid):
        processes.send(pid, signal.SIGKILL)
    terminal.close()
