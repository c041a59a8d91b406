"""The table of docs/site.md, made from the record of a run of `tests/site`."""

from __future__ import annotations

import json
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE, RECORD = ROOT / "docs" / "site.md", ROOT / "docs" / "measured" / "site.json"
BEGIN, END = "<!-- figures -->\n", "<!-- end -->"
_WHO = {"anna": "unit of a Pepper", "ben": "unit of a Robotino, without sound", "proxy": "Caddy and list, for both"}
_WHEN = ("nobody looks", "watched")
_TIMES = {
    "both up [s]": "from `./stack site up` until both units are up",
    "unit up again [s]": "every program of a unit killed: up again after",
    "driven again [s]": "and driven by the same open page after",
    "frozen unit back [s]": "a unit's first program frozen: up again after",
    "proxy back [s]": "Caddy killed: answers again after",
    "at rest [s]": "SIGTERM while both robots drive: both at rest after",
    "ended [s]": "and everything ended after",
}


def table(figures: dict[str, float]) -> str:
    """Return the record's figures as tables.

    Args:
        figures: As `tests/site` writes them: processor time in cores, memory in MB (PSS), times in seconds.
    """
    lines = ["| | nobody looks | driven, one person looks |", "|---|---|---|"]
    for who, words in _WHO.items():
        cells = (
            f"{figures[f'{who}, {when}: cores']:.2f} cores, {figures[f'{who}, {when}: MB']:.0f} MB" for when in _WHEN
        )
        lines.append(f"| {words} | {' | '.join(cells)} |")
    lines += ["", "| | s |", "|---|---|"]
    lines += [f"| {words} | {figures[name]:.1f} |" for name, words in _TIMES.items()]
    return "\n".join(lines) + "\n"


def write(figures: dict[str, float]) -> None:
    """Write record and page."""
    RECORD.write_text(json.dumps(figures, indent=1) + "\n")
    head, _, rest = PAGE.read_text().partition(BEGIN)
    PAGE.write_text(f"{head}{BEGIN}{table(figures)}{END}{rest.partition(END)[2]}")
