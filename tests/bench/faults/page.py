"""Writes the table of docs/last_second.md from the JSON files of the faults benchmark, one or several pieces of it:

    ./stack bench faults --json FILE
    ./stack exec python tests/bench/faults/page.py FILE ...

What stands between `<!-- faults -->` and `<!-- end -->` is replaced, but for rows of which these files have none: a
table of several hours is made in pieces. docs/measured/faults.json keeps the figures, in the same way.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from faults.figures import HEAD, Figures, cells, limits, rows
from faults.trial import Outcome

DOCS = Path(__file__).resolve().parents[3] / "docs"
KEY = 5
"""Cells that name a row."""
PAGE, FIGURES = DOCS / "last_second.md", DOCS / "measured" / "faults.json"


def main() -> None:
    figures = [row for word in sys.argv[1:] for row in read(Path(word))]
    known = json.loads(FIGURES.read_text()) if FIGURES.exists() else []
    new = {(*cells(row)[:KEY], row.load) for row in figures}
    kept = [row for row in known if (*_named(row), row["load"]) not in new]
    lines = [json.dumps(row) for row in (*kept, *(row.as_dict() for row in figures))]
    FIGURES.write_text("[\n" + ",\n".join(lines) + "\n]\n")
    PAGE.write_text(filled(PAGE.read_text(), figures))


def _named(row: dict) -> tuple[str, ...]:
    """The first cells of a row that was kept as figures."""
    by = row["by"] + (", load" if row["load"] else "")
    return row["station"], row["robot"], by, row["victim"], row["fault"]


def read(path: Path) -> list[Figures]:
    """The rows of a JSON file that this benchmark has written."""
    record = json.loads(path.read_text())
    return rows((Outcome(**one) for one in record["faults"]), record["load"])


def filled(page: str, figures: Sequence[Figures]) -> str:
    """The page with its table made from these rows, and from those that it has besides."""
    before, begin, rest = page.partition("<!-- faults -->\n")
    table, end, after = rest.partition("<!-- end -->")
    known = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in table.splitlines()]
    known = [row for row in known if len(row) == len(HEAD) and row != HEAD and not row[0].startswith("---")]
    new = [cells(row) for row in figures]
    replaced = {row[:KEY] for row in new}
    lines = [limits(), "", f"| {' | '.join(HEAD)} |", "|---" * len(HEAD) + "|"]
    for row in (*(row for row in known if row[:KEY] not in replaced), *new):
        lines.append(f"| {' | '.join(row)} |")
    rows_of: dict[tuple[str, str], list[bool]] = {}
    for line in lines[4:]:
        row = [cell.strip() for cell in line.strip("|").split("|")]
        rows_of.setdefault((row[0], row[2]), []).append(not row[-1])
    short = [f"| {station} | {by} | {len(held)} | {sum(held)} |" for (station, by), held in sorted(rows_of.items())]
    heading = ["| station | driven by | rows | hold |", "|---|---|---|---|"]
    total = f"{sum(map(sum, rows_of.values()))} of {len(lines) - 4} rows hold."
    text = "\n".join([*heading, *short, "", total, "", *lines])
    return f"{before}{begin}{text}\n{end}{after}"


if __name__ == "__main__":
    main()
