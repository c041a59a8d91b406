"""What the window remembers from one start to the next, in a file in the user's home directory."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

from PyQt5.QtCore import QByteArray, QSettings
from PyQt5.QtWidgets import QMainWindow, QSplitter

from telepresence.security import private_files
from telepresence.security.private_files import NotPrivate

NOTHING = "none"
"""Value of TELEPRESENCE_SETTINGS with which nothing is remembered."""
PATIENCE = 2.0
"""Seconds that an ending window waits for the disk."""


def default_file() -> Path | None:
    """Return the path in TELEPRESENCE_SETTINGS, else telepresence/window.ini in the configuration folder (XDG base
    directory); None when nothing is to be remembered."""
    named = os.environ.get("TELEPRESENCE_SETTINGS")
    if named == NOTHING:
        return None
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(named) if named else Path(base, "telepresence", "window.ini")


def _make_private(path: Path) -> bool:
    """Keep a file of settings, robots' addresses and names among them, to its owner; return whether it can be used."""
    try:
        if not path.parent.exists():
            private_files.make_folder(path.parent)
        os.close(private_files.open_file(path, os.O_RDWR | os.O_CREAT))
    except NotPrivate as error:
        print(f"gui: nothing is remembered: {error}", file=sys.stderr)
        return False
    except OSError:  # read-only, for example
        return path.exists()
    return True


class Settings:
    """Settings by name. An invalid one counts as missing, and a file that cannot be written is ignored: neither is a
    reason not to drive.

    Args:
        path: The file; with None nothing is remembered.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path if path is not None and _make_private(path) else None
        self._values: dict[str, object] = {}
        self._lock = threading.Lock()
        self._changed: dict[str, str | QByteArray] = {}
        self._writer: threading.Thread | None = None
        if self._path is not None:
            stored = QSettings(str(self._path), QSettings.Format.IniFormat)
            self._values = {name: stored.value(name) for name in stored.allKeys()}

    def text(self, name: str, otherwise: str = "") -> str:
        """Return what was saved under this name; `otherwise` when nothing was."""
        value = self._values.get(name)
        return value if isinstance(value, str) else otherwise

    def number(self, name: str, otherwise: float) -> float:
        """Return the number that was saved under this name; `otherwise` when none was."""
        try:
            return float(self.text(name, str(otherwise)))
        except ValueError:
            return otherwise

    def save(self, name: str, value: str | float | QByteArray) -> None:
        """Save a value under this name, if it is another one."""
        if self._path is None:
            return
        wanted, known = value if isinstance(value, QByteArray) else str(value), self._values.get(name)
        if type(known) is not type(wanted) or known != wanted:  # to PyQt5 None equals bytes that begin with a zero
            self._values[name] = wanted
            with self._lock:
                self._changed[name] = wanted

    def write(self) -> None:
        """Begin to write what has changed; whoever writes already goes on with it. Qt waits until it is on the disk,
        which takes seconds while other programs write, and a window that waits is taken for frozen: a thread does it.
        """
        with self._lock:
            if self._path is not None and self._changed and not (self._writer and self._writer.is_alive()):
                self._writer = threading.Thread(target=self._write_changes, name="settings", daemon=True)
                self._writer.start()

    def close(self) -> None:
        """Write what has changed, and wait for the disk."""
        self.write()
        writer = self._writer
        if writer is not None:
            writer.join(PATIENCE)

    def _write_changes(self) -> None:
        assert self._path is not None
        while True:
            with self._lock:
                changed, self._changed = self._changed, {}
                if not changed:
                    self._writer = None
                    return
            _write(self._path, changed)

    def restore_window(self, window: QMainWindow) -> bool:
        """Restore size, position and splitters; return False when none were saved.

        A window that fills a small screen already keeps its place: Qt would leave room for a title bar above it, which
        nobody draws on a display without a window manager.
        """
        geometry, screen = self._bytes("window/geometry"), window.screen()
        fills = window.isMaximized() or (screen is not None and window.height() >= screen.availableGeometry().height())
        if geometry is None or not (fills or window.restoreGeometry(geometry)):
            return False
        for splitter in window.findChildren(QSplitter):
            # Up to version 0.9.0 there was one value for all robots.
            state = self._bytes(_key_of(splitter)) or self._bytes(f"window/{splitter.objectName()}")
            if state is not None:
                splitter.restoreState(state)
        return True

    def save_window(self, window: QMainWindow) -> None:
        """Save size, position and splitters."""
        self.save("window/geometry", window.saveGeometry())
        for splitter in window.findChildren(QSplitter):
            self.save(_key_of(splitter), splitter.saveState())

    def _bytes(self, name: str) -> QByteArray | None:
        value = self._values.get(name)
        return value if isinstance(value, QByteArray) else None


def _key_of(splitter: QSplitter) -> str:
    """Return the name of a splitter's setting, of which the name of its robot's page is part."""
    page = splitter.parentWidget()
    while page is not None and not isinstance(page, QMainWindow):
        page = page.parentWidget()
    return "/".join(name for name in ("window", page.objectName() if page else "", splitter.objectName()) if name)


def _write(path: Path, values: dict[str, str | QByteArray]) -> None:
    settings = QSettings(str(path), QSettings.Format.IniFormat)
    for name, value in values.items():
        settings.setValue(name, value)
    settings.sync()
