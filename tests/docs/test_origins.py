"""docs/origins.md: the lines that users of the public drivers type start what the page says, and nothing else."""

from __future__ import annotations

import os
import subprocess

import pytest
from guide_lines import ROOT, WORD, tables

PAGE = ROOT / "docs" / "origins.md"


def _lines() -> dict[str, tuple[str, ...]]:
    """Return each line with its nodes; one whose row names none has those of the row above it."""
    found: dict[str, tuple[str, ...]] = {}
    nodes: tuple[str, ...] = ()
    for row in tables(PAGE, "## Lines of the public drivers")["What a lab types, and the nodes that it starts"]:
        nodes = row.prints or nodes
        found[row.line] = nodes
    return found


LINES = _lines()


@pytest.mark.parametrize("line", LINES)
def test_a_line_of_a_public_driver_starts_what_the_page_says(line: str):
    environment = {name: value for name, value in os.environ.items() if name not in ("ROBOT", "ROBOT_ENV", "NAO_IP")}
    words = ["bash", "-c", f"{WORD.sub('127.0.0.1', line)} --nodes"]  # what is the reader's to fill in are addresses
    answer = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120)
    assert set(answer.stdout.split()) == {*LINES[line]}, answer.stderr
