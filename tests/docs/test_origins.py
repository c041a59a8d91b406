"""docs/origins.md: the lines that users of the public drivers type start what the page says."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from guide_lines import GuideLine, tables, typed

PAGE = Path(__file__).resolve().parents[2] / "docs" / "origins.md"
LINES = tables(PAGE, "## Lines of the public drivers")["What a lab types, and the nodes that it starts"]


@pytest.mark.parametrize("line", LINES, ids=lambda line: line.line)
def test_a_line_of_a_public_driver_starts_what_the_page_says(line: GuideLine):
    environment = {name: value for name, value in os.environ.items() if name not in ("ROBOT", "ROBOT_ENV", "NAO_IP")}
    with typed(line, environment, "--nodes", ROBOT_IP="127.0.0.1", MY_IP="127.0.0.1"):
        pass
