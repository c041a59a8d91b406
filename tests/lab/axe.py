"""What axe finds in a page; where it comes from is said in tests/telepresence/page/test_accessible.py."""

from __future__ import annotations

from pathlib import Path

from page_in_process import PageBrowser

AXE = Path(__file__).parents[1] / "telepresence" / "page" / "axe" / "axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]


def violations(browser: PageBrowser) -> list[str]:
    """Return what breaks a rule of WCAG, A or AA, in the page as it is now."""
    if browser.evaluate("typeof axe") == "undefined":
        browser.evaluate(AXE.read_text() + "; 1")
    found = browser.evaluate(
        f"axe.run({{runOnly: {RULES}, resultTypes: ['violations']}}).then((r) => r.violations.map((v) =>"
        "`${v.id}: ${v.nodes.map((n) => n.target + ' ' + n.failureSummary).join('; ')}`))"
    )
    assert isinstance(found, list)
    return found


def wear(browser: PageBrowser, theme: str) -> None:
    """Show the pilot's page dark or light."""
    browser.evaluate(f"document.documentElement.dataset.theme = '{theme}'")
