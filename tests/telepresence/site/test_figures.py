"""What docs/site.md says that a robot costs is what was measured."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

FILE = Path(__file__).resolve().parents[2] / "site" / "figures.py"


def test_the_page_has_the_figures_of_the_record():
    found = importlib.util.spec_from_file_location("site_figures", FILE)
    figures = importlib.util.module_from_spec(found)
    found.loader.exec_module(figures)
    page = figures.PAGE.read_text().partition(figures.BEGIN)[2].partition(figures.END)[0]
    assert page == figures.table(json.loads(figures.RECORD.read_text()))
