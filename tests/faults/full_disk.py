"""Run in a folder on a small disk: writes there what a station writes, then once more with the disk full.

Prints a line of JSON: what stands in each file at the end, and what the programs said.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
from pathlib import Path

import numpy as np
from cheap_passwords import CHEAP

from gui.recording.film import Film
from gui.settings import Settings
from telepresence.security import private_files
from telepresence.teleop.accounts import UserError, Users

LONG = "x" * 50_000
"""More than what is left over in the last block of any file."""


def fill(path: Path) -> None:
    """Leave no byte free."""
    with contextlib.suppress(OSError), path.open("wb", buffering=0) as file:
        while file.write(b"\0" * 4096):
            pass


def said(action) -> str:
    """What is raised, as a person reads it; empty when nothing is."""
    try:
        action()
    except (OSError, UserError) as error:
        return str(error)
    return ""


def main() -> None:
    folder = Path(sys.argv[1])
    settings, accounts, report, film = (folder / name for name in ("window.ini", "users.db", "report.html", "film.mp4"))
    kept = Settings(settings)
    kept.save("robot", "old")
    kept.close()
    users = Users(accounts, CHEAP)
    users.add("anna", "correct horse", "pilot")
    private_files.write(report, b"old")
    pictures = Film(film)
    pictures.add(np.zeros((48, 64, 3), np.uint8), 0.0)
    fill(folder / "filling")
    messages = {
        "report": said(lambda: private_files.write(report, LONG.encode())),
        "accounts": said(lambda: [users.add(f"bert{number}" * 12, "correct horse", "pilot") for number in range(99)]),
        "film": said(lambda: [pictures.add(noise(number), 0.1 * number) for number in range(1, 99)]),
    }
    kept.save("robot", LONG)
    kept.close()
    left_whole = settings.read_text()[:99]
    (folder / "filling").unlink()
    kept.save("name", "anna")
    kept.close()
    print(json.dumps({
        "messages": messages,
        "report": report.read_text(),
        "accounts": "anna" in [account.name for account in Users(accounts, CHEAP).all()],
        "settings": left_whole,
        "settings later": LONG in settings.read_text() and "name=anna" in settings.read_text(),
        "left": sorted(name for name in os.listdir(folder) if name.startswith(".")),
    }), flush=True)  # fmt: skip
    os._exit(0)  # PyAV would say once more that it could not write


def noise(number: int) -> np.ndarray:
    """A picture that cannot be compressed."""
    return np.random.default_rng(number).integers(0, 255, (48, 64, 3), np.uint8)


if __name__ == "__main__":
    main()
