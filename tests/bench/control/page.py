"""Writes the tables and pictures of docs/control.md from a folder of the control benchmark:

    ./stack bench control --out FOLDER
    ./stack exec python tests/bench/control/page.py FOLDER

What stands between `<!-- NAME -->` and `<!-- end -->` is replaced; docs/measured/control.json keeps the figures.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from control.run import STRATEGIES
from control.tasks import TASKS
from control.vehicles import VEHICLES

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE, FIGURES = DOCS / "control.md", DOCS / "measured" / "control.json"
PICTURES = ("control.png", "control_square.png")


def main() -> None:
    folder = Path(sys.argv[1])
    record = json.loads((folder / "control.json").read_text())
    kept = {name: record[name] for name in ("seeds", "walk_seeds", "cells", "walks")}
    FIGURES.write_text(json.dumps(kept, indent=1) + "\n")
    PAGE.write_text(filled(PAGE.read_text(), kept))
    for picture in PICTURES:
        shutil.copyfile(folder / picture, DOCS / picture)


def filled(page: str, record: dict) -> str:
    """The page with its tables made from `record`."""
    tables = {"errors": _errors, "costs": _costs, "walks": _walks}
    for name, make in tables.items():
        lines = "\n".join(make(record))
        pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
        page = re.sub(pattern, lambda found, lines=lines: f"{found[1]}{lines}\n{found[2]}", page, flags=re.DOTALL)
    return page


def _errors(record: dict) -> list[str]:
    """Mean and worst error, and how many failed: a row for each robot and task, a column for each strategy."""
    at = {(c["vehicle"], c["task"], c["strategy"]): c for c in record["cells"]}
    lines = [f"| robot | task | {' | '.join(STRATEGIES)} |", "|---|---|" + "---|" * len(STRATEGIES)]
    for vehicle, kind in VEHICLES.items():
        for task in TASKS:
            found = [at.get((vehicle, task, strategy)) for strategy in STRATEGIES]
            lines.append(f"| {kind.label} | {task} | {' | '.join(map(_error, found))} |")
    return lines


def _error(cell: dict | None) -> str:
    if cell is None:
        return "–"
    failed = cell["trials"] - cell["successes"]
    causes = [f"{cell[name]} {name}" for name in ("touched", "falls") if cell[name]]
    text = f"{100 * cell['error']:.1f} ({100 * cell['worst']:.1f})"
    if not failed:
        return text
    return f"{text}, **{failed} of {cell['trials']} failed**" + (f": {', '.join(causes)}" if causes else "")


def _costs(record: dict) -> list[str]:
    """Time, work and slip by odometry without the gate: a row for each robot, a column for each task."""
    at = {(c["vehicle"], c["task"]): c for c in record["cells"] if c["strategy"] == "odometry"}
    lines = [f"| robot | {' | '.join(TASKS)} |", "|---|" + "---|" * len(TASKS)]
    for vehicle, kind in VEHICLES.items():
        cells = (at[vehicle, task] for task in TASKS)
        texts = (f"{c['time']:.1f} s, {c['work']:.1f} J, {100 * c['slip']:.1f} cm" for c in cells)
        lines.append(f"| {kind.label} | {' | '.join(texts)} |")
    return lines


def _walks(record: dict) -> list[str]:
    head = ("gait", "ground", "way", "walked 1 m", "falls", "distance [m]", "coasts [mm]", "drifts [mm]")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for c in record["walks"]:
        way = "forward" if c["direction"] > 0 else "backward"
        lines.append(
            f"| {c['vehicle']} | {c['scene']} | {way} | {c['successes']} of {c['walks']} | {c['falls']} | "
            f"{c['shortest']:.2f} – {c['longest']:.2f} | {1000 * c['coast']:.0f} | {1000 * c['drift']:.1f} |"
        )
    return lines


if __name__ == "__main__":
    main()
