"""The pilot's page as people see and press it, in whatever browser it is open."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

PASSWORD = "correct horse"


class OpenPage(ABC):
    @abstractmethod
    def evaluate(self, expression: str) -> Any:
        """Return what a script comes to in the page, as if somebody had pressed something."""

    @abstractmethod
    def key(self, code: str, down: bool) -> None:
        """Press or release a key, by the name of its place on the keyboard, as `KeyW`."""

    def text(self, part: str) -> str:
        return self.evaluate(f"document.getElementById('{part}')?.textContent ?? ''")

    def sign_in(self, name: str, password: str = PASSWORD) -> None:
        self.evaluate(
            f"document.querySelector('[name=name]').value = '{name}';"
            f"document.querySelector('[name=password]').value = '{password}';"
            "document.querySelector('#enterForm button').click()"
        )

    def width(self) -> int:
        return self.evaluate("document.getElementById('picture')?.videoWidth ?? 0") or 0

    def way(self) -> str:
        """Which way the page says that it takes."""
        return self.evaluate("document.getElementById('way')?.dataset.way ?? ''")

    def asks(self) -> bool:
        """Whether the page asks who it is."""
        return self.evaluate("document.getElementById('enter')?.hidden === false")

    def is_there(self) -> bool:
        """Whether the page shows pictures of now, and has the robot."""
        return self.evaluate(
            "((part) => !part('drive').hidden && part('take').hidden && part('picture').videoWidth > 0"
            " && !part('picture').classList.contains('stale'))((id) => document.getElementById(id))"
        )
