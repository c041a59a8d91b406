"""docs/guides.md: every thing that the three guides name has a row, a state, a place in the tree, and a reason if it
differs; what can be typed with nothing running prints what the page says."""

from __future__ import annotations

import os
import re
import subprocess
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import pytest
from guide_lines import GuideLine, tables, typed

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "guides.md"
GUIDES = {"A": 103, "B": 143, "C": 69}
"""How many things each guide names."""
KEPT, DIFFERENT = "●", "◆"


class Row(NamedTuple):
    """A thing that a guide names, and where the project has it."""

    number: str
    state: str
    thing: str
    where: str
    reason: str


def _rows() -> list[Row]:
    lines = re.findall(r"^\| [ABC]\d+ \|.*$", PAGE.read_text(), re.MULTILINE)
    return [Row(*(cell.strip() for cell in line.strip("|").split("|"))) for line in lines]


ROWS = _rows()
LINES = tables()


def test_every_thing_has_a_row_in_the_guides_order():
    assert [row.number for row in ROWS] == [f"{guide}{n + 1}" for guide, count in GUIDES.items() for n in range(count)]


@pytest.mark.parametrize("guide", GUIDES)
def test_a_row_that_differs_says_why_and_no_other_does(guide: str):
    rows = [row for row in ROWS if row.number.startswith(guide)]
    assert {row.state for row in rows} <= {KEPT, DIFFERENT}
    assert [row.number for row in rows if (row.state == DIFFERENT) != bool(row.reason)] == []
    assert [row.number for row in rows if not row.thing] == []


def test_as_a_reason_may_be_another_rows():
    different = {row.number for row in ROWS if row.state == DIFFERENT}
    referred = {name for row in ROWS for name in re.findall(r"^as ([ABC]\d+)", row.reason)}
    assert referred <= different


def test_the_counts_are_those_of_the_rows():
    counts = Counter((row.number[0], row.state) for row in ROWS)
    totals = re.findall(r"^\| (?:([ABC])\.|together).*\| (\d+) \| (\d+) \| (\d+) \|$", PAGE.read_text(), re.MULTILINE)
    found = {guide or "ABC": tuple(map(int, numbers)) for guide, *numbers in totals}
    for guides in (*GUIDES, "ABC"):
        kept, different = (sum(counts[guide, state] for guide in guides) for state in (KEPT, DIFFERENT))
        assert found[guides] == (kept + different, kept, different)


def test_every_place_exists():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    files = {f"/{name}" for name in listed}
    places = {parent for name in listed for parent in (f"/{name}", *(f"/{folder}" for folder in Path(name).parents))}
    assert files
    gone = [
        (row.number, place)
        for row in ROWS
        for place in re.findall(r"`([^`]+)`", re.sub(r"\(.*?\)", "", row.where))
        if not any(known.endswith(f"/{place}") for known in places)
    ]
    assert gone == []


def test_a_row_without_a_place_is_about_the_systems_own_programs():
    assert all("ROS 1 spells" in row.reason or "ROS 1 knows" in row.reason for row in ROWS if not row.where)


@pytest.mark.parametrize("line", LINES["Anywhere, with nothing running"], ids=lambda line: line.line)
def test_a_line_that_needs_nothing_prints_what_the_page_says(line: GuideLine):
    environment = {name: value for name, value in os.environ.items() if name != "NAO_IP"}
    with typed(line, environment):
        pass


@pytest.mark.parametrize("line", LINES["The launch files, which rostest runs whole"], ids=lambda line: line.line)
def test_a_launch_line_has_the_nodes_that_the_page_says(line: GuideLine):
    with typed(line, os.environ, "--nodes", ROBOT_IP="127.0.0.1", MY_IP="127.0.0.1"):
        pass


def test_every_table_of_lines_is_typed_by_a_test():
    """This file and those that have a robot running."""
    tests = "".join(path.read_text() for path in ROOT.glob("tests/**/test_*.py"))
    assert LINES and [heading for heading in LINES if f'["{heading}"]' not in tests] == []
