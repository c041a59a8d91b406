"""CONTRIBUTING.md: its table of rostests names those that there are."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PART = "### Launch files: rostest"


def test_the_table_of_rostests_has_every_file():
    part = (ROOT / "CONTRIBUTING.md").read_text().partition(PART)[2].partition("\n### ")[0]
    named = [
        (package, file)
        for packages, files in re.findall(r"^\| (`.*) \| (`.*) \|.*\|$", part, re.MULTILINE)
        for package, group in zip(re.findall(r"`(\w+)`", packages), files.split("; "), strict=True)
        for file in re.findall(r"`([\w.]+)`", group)
    ]
    there = [(path.parts[-3], path.name) for path in ROOT.glob("catkin_ws/src/*/test/*.test")]
    assert sorted(named) == sorted(there)
