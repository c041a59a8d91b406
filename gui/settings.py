"""What the window remembers from one start to the next, in a file of the person's own."""

from __future__ import annotations

import os
from pathlib import Path

from PyQt5.QtCore import QByteArray, QSettings
from PyQt5.QtWidgets import QMainWindow, QSplitter

NOTHING = "none"
"""Value of TELEPRESENCE_SETTINGS with which nothing is remembered."""


def default_file() -> Path | None:
    """TELEPRESENCE_SETTINGS, else telepresence/window.ini where settings are kept (XDG base directory)."""
    named = os.environ.get("TELEPRESENCE_SETTINGS")
    if named == NOTHING:
        return None
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(named) if named else Path(base, "telepresence", "window.ini")


class Settings:
    """Settings by name; wrong or missing ones are as if never kept, and a file that can't be written is no reason not
    to drive.

    Args:
        path: The file; None remembers nothing.
    """

    def __init__(self, path: Path | None) -> None:
        self._settings = QSettings(str(path), QSettings.Format.IniFormat) if path is not None else None

    def text(self, name: str, otherwise: str = "") -> str:
        """What was kept under this name."""
        value = self._settings.value(name, otherwise) if self._settings is not None else otherwise
        return value if isinstance(value, str) else otherwise

    def number(self, name: str, otherwise: float) -> float:
        """What was kept under this name."""
        try:
            return float(self.text(name, str(otherwise)))
        except ValueError:
            return otherwise

    def save(self, name: str, value: str | float | QByteArray) -> None:
        """Under this name from now on."""
        if self._settings is not None:
            self._settings.setValue(name, value if isinstance(value, QByteArray) else str(value))

    def restore_window(self, window: QMainWindow) -> bool:
        """Size, place and splitters as they were; False when nothing was kept."""
        geometry = self._bytes("window/geometry")
        if geometry is None or not window.restoreGeometry(geometry):
            return False
        for splitter in window.findChildren(QSplitter):
            state = self._bytes(f"window/{splitter.objectName()}")
            if state is not None:
                splitter.restoreState(state)
        return True

    def save_window(self, window: QMainWindow) -> None:
        """Size, place and splitters."""
        self.save("window/geometry", window.saveGeometry())
        for splitter in window.findChildren(QSplitter):
            self.save(f"window/{splitter.objectName()}", splitter.saveState())
        if self._settings is not None:
            self._settings.sync()

    def _bytes(self, name: str) -> QByteArray | None:
        value = self._settings.value(name) if self._settings is not None else None
        return value if isinstance(value, QByteArray) else None
