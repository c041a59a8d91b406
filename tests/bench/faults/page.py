"""Writes the tables of docs/last_second.md and of docs/measured/last_second_rows.md from the JSON files of the faults
benchmark, one or several pieces of it:

    ./stack bench faults --json FILE
    ./stack exec python tests/bench/faults/page.py FILE ...

What stands between `<!-- faults -->` and `<!-- end -->` is replaced: in the one page the sums and the rows that break a
limit, in the other all rows. Rows of which these files have none stay: a table of several hours is made in pieces.
docs/measured/faults.json keeps the figures, in the same way.
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
PAGE, ROWS, FIGURES = DOCS / "last_second.md", DOCS / "measured/last_second_rows.md", DOCS / "measured/faults.json"
BEGIN, END = "<!-- faults -->\n", "<!-- end -->"
Row = tuple[str, ...]


def main() -> None:
    figures = [row for word in sys.argv[1:] for row in read(Path(word))]
    known = json.loads(FIGURES.read_text()) if FIGURES.exists() else []
    new = {(*cells(row)[:KEY], row.load) for row in figures}
    kept = [row for row in known if (*_named(row), row["load"]) not in new]
    lines = [json.dumps(row) for row in (*kept, *(row.as_dict() for row in figures))]
    FIGURES.write_text("[\n" + ",\n".join(lines) + "\n]\n")
    ROWS.write_text(filled(ROWS.read_text(), figures))
    PAGE.write_text(summarised(PAGE.read_text(), known_rows(ROWS.read_text())))


def _named(row: dict) -> tuple[str, ...]:
    """The first cells of a row that was kept as figures."""
    by = row["by"] + (", load" if row["load"] else "")
    return row["station"], row["robot"], by, row["victim"], row["fault"]


def read(path: Path) -> list[Figures]:
    """The rows of a JSON file that this benchmark has written."""
    record = json.loads(path.read_text())
    return rows((Outcome(**one) for one in record["faults"]), record["load"])


def known_rows(page: str) -> list[Row]:
    """The rows that a page's table of all rows has."""
    table = page.partition(BEGIN)[2].partition(END)[0]
    found = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in table.splitlines()]
    return [row for row in found if len(row) == len(HEAD) and row != HEAD and not row[0].startswith("---")]


def filled(page: str, figures: Sequence[Figures]) -> str:
    """The page with its table made from these rows, and from those that it has besides."""
    new = [cells(row) for row in figures]
    replaced = {row[:KEY] for row in new}
    kept = [row for row in known_rows(page) if row[:KEY] not in replaced]
    return _between(page, [limits(), "", *_table([*kept, *new])])


def summarised(page: str, rows: Sequence[Row]) -> str:
    """The page with how many of these rows hold, and those that break a limit."""
    held: dict[tuple[str, str], list[bool]] = {}
    for row in rows:
        held.setdefault((row[0], row[2]), []).append(not row[-1])
    sums = [f"| {station} | {by} | {len(each)} | {sum(each)} |" for (station, by), each in sorted(held.items())]
    broken = [row for row in rows if row[-1]]
    total = f"{len(rows) - len(broken)} of {len(rows)} rows hold."
    heading = ["| station | driven by | rows | hold |", "|---|---|---|---|"]
    return _between(page, [*heading, *sums, "", total, *(["", limits(), "", *_table(broken)] if broken else [])])


def _table(rows: Sequence[Row]) -> list[str]:
    return [f"| {' | '.join(HEAD)} |", "|---" * len(HEAD) + "|", *(f"| {' | '.join(row)} |" for row in rows)]


def _between(page: str, lines: Sequence[str]) -> str:
    """The page with these lines between its marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    return f"{before}{begin}{chr(10).join(lines)}\n{end}{after}"


if __name__ == "__main__":
    main()
