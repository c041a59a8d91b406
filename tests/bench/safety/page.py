"""Writes the tables and pictures of docs/safety.md from a folder of the safety benchmark:

    ./stack bench safety --out FOLDER
    ./stack exec python tests/bench/safety/page.py FOLDER

What stands between `<!-- NAME -->` and `<!-- end -->` is replaced; docs/measured/safety.json keeps the figures.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE, FIGURES = DOCS / "safety.md", DOCS / "measured" / "safety.json"
PICTURES = ("safety.png", "safety_scenario.png")
ROBOTS = {
    "infrared": "Robotino, infrared",
    "measured": "Robotino, infrared, slow",
    "laser": "Robotino, laser",
    "pepper": "Pepper",
}
MUST_STOP = ("sensors silent", "sensors frozen", "NaN and infinity", "all -1", "link cut")
"""Faults at which the robot has to stand."""
HEAD = (
    "gate", "scenarios", "commands", "hits", "per 1000 commands (95 %)", "per 100 m", "passed", "stood",
    "goals per 100 m", "clearance 5 %", "people",
)  # fmt: skip


def main() -> None:
    folder = Path(sys.argv[1])
    text = (folder / "safety.json").read_text()
    PAGE.write_text(filled(PAGE.read_text(), json.loads(text)))
    FIGURES.write_text(text)
    for picture in PICTURES:
        shutil.copyfile(folder / picture, DOCS / picture)


def filled(page: str, record: dict) -> str:
    """The page with its tables made from `record`."""
    tables = {robot: _gates(record, robot) for robot in ROBOTS}
    tables |= {"faults": _faults(record), "trials": _trials(record), "stack": _stack(record)}
    for name, rows in tables.items():
        head, *rest = ("| " + " | ".join(row) + " |" for row in rows)
        lines = "\n".join([head, "|" + "---|" * len(rows[0]), *rest])
        pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
        page, count = re.subn(pattern, lambda found, lines=lines: f"{found[1]}{lines}\n{found[2]}", page, flags=re.S)
        if count != 1:
            raise SystemExit(f"{PAGE.name} has {count} places for the table {name!r}; one is needed")
    return page


def _gates(record: dict, robot: str) -> list[tuple[str, ...]]:
    """A row for each gate and speed, faults left out."""
    cells = [cell for cell in record["cells"] if cell["robot"] == robot and not cell["fault"]]
    return [HEAD] + [_figures(f"{cell['gate']}, {cell['speed']:.2f} m/s", cell) for cell in cells]


def _figures(name: str, cell: dict) -> tuple[str, ...]:
    rate = cell["per_1000"]
    # Infrared beams leave gaps everywhere, Pepper's lasers leave whole sectors out.
    blind = f" ({cell['blind_hits']} where no beam looks)" if cell["robot"] == "pepper" and cell["blind_hits"] else ""
    return (
        name, f"{cell['scenarios']}", f"{cell['commands']:,}", f"{cell['hits']}{blind}",
        f"{rate['value']:.3f} ({rate['low']:.3f}–{rate['high']:.3f})", f"{cell['per_100_m']['value']:.2f}",
        f"{100 * cell['passed']:.1f} %", f"{100 * cell['standing']:.1f} %", f"{cell['goals']:.1f}",
        f"{100 * cell['gap_5']:.1f} cm", f"{cell['person_hits']} + {cell['walked_into']}",
    )  # fmt: skip


def _faults(record: dict) -> list[tuple[str, ...]]:
    rows = [("fault", "scenarios", "commands", "hits", "passed", "longest time to the gate's first zero")]
    for cell in record["cells"]:
        if cell["fault"]:
            stopped = cell["stopped_after"] if cell["fault"] in MUST_STOP else None
            rows.append(
                (
                    cell["fault"], f"{cell['scenarios']}", f"{cell['commands']:,}", f"{cell['hits']}",
                    f"{100 * cell['passed']:.1f} %", "–" if stopped is None else f"{stopped:.2f} s",
                )
            )  # fmt: skip
    return rows


def _trials(record: dict) -> list[tuple[str, ...]]:
    """A row for each trial, a column for each robot."""
    rows = [("trial", "wanted", *ROBOTS.values())]
    for name in dict.fromkeys(trial["name"] for trial in record["trials"]):
        found = {trial["robot"]: trial for trial in record["trials"] if trial["name"] == name}
        any_of = next(iter(found.values()))
        texts = (_trial(found[robot]) if robot in found else "–" for robot in ROBOTS)
        rows.append((name, f"{any_of['judged']} {any_of['wanted']:.3g} {any_of['unit']}", *texts))
    return rows


def _trial(trial: dict) -> str:
    return ", ".join(f"{name.replace('_', ' ')} {value:.3g}" for name, value in trial["values"].items())


def _stack(record: dict) -> list[tuple[str, ...]]:
    rows = [("what", "measured", "against")]
    for row in record["stack"]:
        unit = f" {row['unit']}" if row["unit"] else ""
        rows.append(
            (row["metric"], f"{row['ours']:.3g}{unit}", f"{row['reference']:.3g}{unit} ({row['reference_name']})")
        )
    return rows


if __name__ == "__main__":
    main()
