"""Where the accounts are. Standard library only: `./stack doctor` asks before anything is installed."""

from __future__ import annotations

import os
from pathlib import Path


def default_path() -> Path:
    """Return the path of the accounts: TELEPRESENCE_USERS, else gui/users.db; of a user who may not write into the
    checkout, ~/telepresence/users.db."""
    if named := os.environ.get("TELEPRESENCE_USERS"):
        return Path(named)
    folder = Path(__file__).resolve().parents[2] / "gui"
    return (folder if os.access(folder, os.W_OK) else Path.home() / "telepresence") / "users.db"
