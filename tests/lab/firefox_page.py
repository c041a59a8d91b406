"""The pilot's page in Firefox."""

from __future__ import annotations

from typing import Any

from firefox import Firefox
from open_page import OpenPage

_ERRORS = """() => {
  globalThis.errors = [];
  for (const kind of ["error", "unhandledrejection"])
    addEventListener(kind, (event) => errors.push(String(event.message ?? event.reason)));
}"""


class FirefoxPage(OpenPage):
    """The page in a browser of its own.

    Args:
        before: What to run before the page's own scripts, in JavaScript.
    """

    def __init__(self, url: str, before: str = "") -> None:
        self.browser = Firefox(_ERRORS.replace("{", "{" + before, 1))
        self.browser.resize(1280, 720)
        self.browser.navigate(url)

    @property
    def errors(self) -> list[str]:
        """Exceptions that nobody caught in the page."""
        return self.evaluate("errors")

    def evaluate(self, expression: str) -> Any:
        return self.browser.evaluate(expression)

    def key(self, code: str, down: bool) -> None:
        self.browser.key(code[-1].lower(), down)
