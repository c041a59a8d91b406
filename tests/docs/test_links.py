"""What the pages point at exists: files, headings, and paths that they name in backticks."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + sorted(ROOT.glob("docs/*.md"))
FOLDERS = [ROOT, ROOT / "docs", ROOT / "catkin_ws" / "src", *ROOT.glob("catkin_ws/src/*/src")]
"""Where a path in backticks may begin; a page about one folder leaves that folder out of its table."""
CODE = re.compile(r"^```.*?^```", re.M | re.S)
LINK = re.compile(r"\]\(([^()\s]+)\)")
PATH = re.compile(
    r"`((?:[\w.@-]+/)+[\w.@-]*\.(?:py|md|ui|xml|msg|srv|action|launch|toml|qss|csv|json|service|yaml|rviz))`"
)
"""A path with a folder and a known ending; topics have none."""
MADE = {"gui/users.db"}
"""Made by a program when it is first needed."""
FOLDER = re.compile(r"`((?:telepresence|pepper_sim|robotino_sim|gui|catkin_ws|tests|docs|launch)/[\w./-]*)`")


def _prose(page: Path) -> str:
    """The page without its blocks of code, whose # are no headings."""
    return CODE.sub("", page.read_text())


def _anchors(page: Path) -> set[str]:
    """Its headings as GitHub names them."""
    headings = re.findall(r"^#+ +(.+)$", _prose(page), re.M)
    plain = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in headings)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files_and_headings(page: Path):
    broken = []
    for link in LINK.findall(_prose(page)):
        if link.startswith(("http://", "https://")):
            continue
        path, _, heading = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (heading and heading not in _anchors(target)):
            broken.append(link)
    assert not broken


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_paths_in_backticks_exist(page: Path):
    # The changelog tells which names are gone.
    text = _prose(page).partition("<!-- old names -->")[0] if page.name == "CHANGELOG.md" else _prose(page)
    named = {*PATH.findall(text), *FOLDER.findall(text)} - MADE
    missing = sorted(path for path in named if not any((folder / path).exists() for folder in FOLDERS))
    assert not missing


def test_a_broken_link_and_a_missing_heading_are_found(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text("# One *two*\n[a](page.md#one-two) [b](page.md#three) [c](gone.md)\n```\n# four\n```\n")
    assert _anchors(page) == {"one-two"}
    with pytest.raises(AssertionError, match=r"page.md#three.*gone.md"):
        test_links_lead_to_files_and_headings(page)
