"""Colours of the window: one style sheet, and a file of named colours for each theme."""

from __future__ import annotations

import re
import tomllib
from functools import cache, lru_cache
from pathlib import Path
from types import MappingProxyType

from PyQt5.QtGui import QColor
from PyQt5.QtWidgets import QApplication

DEFAULT = "dark"
_FOLDER = Path(__file__).resolve().parent / "themes"
_PROPERTY = "theme"


def themes() -> list[str]:
    """Return the names of all themes."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


@lru_cache
def colours(theme: str) -> MappingProxyType[str, str]:
    """Return the colours of a theme: name -> "#rrggbb".

    Raises:
        ValueError: There is no such theme; the message names those that exist.
    """
    if theme not in themes():
        raise ValueError(f"there is no theme '{theme}'; known: {', '.join(themes())}")
    return MappingProxyType(tomllib.loads((_FOLDER / f"{theme}.toml").read_text(encoding="utf-8")))


def style_sheet(theme: str) -> str:
    """Return the style sheet in the colours of a theme.

    Raises:
        ValueError: There is no such theme, or the sheet names a colour that it lacks.
    """
    known = colours(theme)

    def colour_of(found: re.Match[str]) -> str:
        if found[1] not in known:
            raise ValueError(f"window.qss asks for the colour @{found[1]}, which {theme}.toml does not have")
        return known[found[1]]

    return re.sub(r"@(\w+)", colour_of, (_FOLDER / "window.qss").read_text(encoding="utf-8"))


def application() -> QApplication:
    """Return the running application.

    Raises:
        RuntimeError: None has been made yet.
    """
    found = QApplication.instance()
    if not isinstance(found, QApplication):
        raise RuntimeError("there is no QApplication yet")
    return found


def apply(theme: str) -> None:
    """Use a theme for the whole application; widgets that paint themselves are repainted.

    Raises:
        ValueError: There is no such theme.
    """
    sheet = style_sheet(theme)
    application().setProperty(_PROPERTY, theme)
    current.cache_clear()
    application().setStyleSheet(sheet)
    for widget in application().allWidgets():
        widget.update()


@cache
def current() -> str:
    """Return the theme that `apply` was last called with."""
    return application().property(_PROPERTY) or DEFAULT


def colour(name: str, alpha: float = 1.0) -> QColor:
    """Return a colour of the current theme for a painter.

    Args:
        alpha: 0 is transparent, 1 opaque.
    Raises:
        KeyError: No such colour.
    """
    return QColor(_colour(current(), name, alpha))


@lru_cache(1024)  # a fading one has many alphas
def _colour(theme: str, name: str, alpha: float) -> QColor:
    found = QColor(colours(theme)[name])
    found.setAlphaF(alpha)
    return found
