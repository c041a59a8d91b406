"""SQLite files that only their owner reads."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from telepresence.security import private_files

BUSY_TIMEOUT = 5.0
"""Seconds for which another process may hold the file."""


@contextlib.contextmanager
def opened(path: Path, schema: str) -> Iterator[sqlite3.Connection]:
    """Open a database, made with its folder if necessary; its transactions belong to the caller.

    Args:
        schema: SQL that makes the tables that are missing.
    Raises:
        OSError, sqlite3.Error: The file cannot be used, or belongs to somebody else.
    """
    if not path.parent.exists():
        private_files.make_folder(path.parent)
    os.close(private_files.open_file(path, os.O_RDWR | os.O_CREAT))
    with contextlib.closing(sqlite3.connect(path, timeout=BUSY_TIMEOUT)) as database:
        database.execute("PRAGMA secure_delete = ON")  # what was removed is not to be found in the file's rest
        database.executescript(schema)
        yield database
