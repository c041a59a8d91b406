"""Writes the table of docs/last_second.md from the JSON files of the faults benchmark, one or several pieces of it:

    ./stack bench faults --json FILE
    ./stack exec python tests/bench/faults/page.py FILE ...

What stands between `<!-- faults -->` and `<!-- end -->` is replaced; docs/measured/faults.json keeps the figures.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from faults.figures import HEAD, Figures, cells, limits, rows, summary
from faults.trial import Outcome

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE, FIGURES = DOCS / "last_second.md", DOCS / "measured" / "faults.json"


def main() -> None:
    figures = [row for word in sys.argv[1:] for row in read(Path(word))]
    FIGURES.write_text(json.dumps([row.as_dict() for row in figures], indent=1) + "\n")
    PAGE.write_text(filled(PAGE.read_text(), figures))


def read(path: Path) -> list[Figures]:
    """The rows of a JSON file that this benchmark has written."""
    record = json.loads(path.read_text())
    return rows((Outcome(**one) for one in record["faults"]), record["load"])


def filled(page: str, figures: Sequence[Figures]) -> str:
    """The page with its table made from these rows."""
    lines = [limits(), "", f"| {' | '.join(HEAD)} |", "|---" * len(HEAD) + "|"]
    lines += [f"| {' | '.join(cells(row))} |" for row in figures]
    text = "\n".join([*lines, "", f"{summary(figures)}."])
    return re.sub(
        r"(<!-- faults -->\n).*?(<!-- end -->)", lambda found: f"{found[1]}{text}\n{found[2]}", page, flags=re.DOTALL
    )


if __name__ == "__main__":
    main()
