"""Writes the tables of docs/scaling.md from the benchmarks' JSON: `./stack bench fleet bandwidth --json FILE`.

FILE is docs/measured/scaling.json. Then:

    python tests/bench/scaling_figures.py

What stands between `<!-- NAME -->` and `<!-- end -->` is replaced.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, FIGURES = DOCS / "scaling.md", DOCS / "measured" / "scaling.json"
PILOTS = 100


def main() -> None:
    PAGE.write_text(filled(PAGE.read_text(), json.loads(FIGURES.read_text())))


def filled(page: str, figures: dict[str, list[dict]]) -> str:
    """The page with its tables made from `figures`, the JSON of the benchmarks."""
    for name, rows in figures.items():
        lines = site(rows) if name == "bandwidth" else table(rows)
        page = re.sub(
            rf"(<!-- {name} -->\n).*?(<!-- end -->)",
            lambda found, lines=lines: found[1] + "\n".join(lines) + "\n" + found[2],
            page,
            flags=re.DOTALL,
        )
    return page


def table(rows: list[dict]) -> list[str]:
    lines = ["| what | ours | against | ratio |", "|---|---|---|---|"]
    for row in rows:
        unit = f" {row['unit']}" if row["unit"] else ""
        against = f"{digits(row['reference'])}{unit} ({row['reference_name']})"
        lines.append(f"| {row['metric']} | {digits(row['ours'])}{unit} | {against} | {row['ratio']:.2f} |")
    return lines


def site(rows: list[dict]) -> list[str]:
    """Bandwidth of one pilot and of a hundred."""
    lines = [f"| stream | one pilot | {PILOTS} pilots | against |", "|---|---|---|---|"]
    for row in rows:
        one = row["ours"]
        share = f"{100 * row['ratio']:.1f} % of {row['reference_name']}"
        lines.append(f"| {row['metric']} | {digits(one)} Mbit/s | {digits(one * PILOTS / 1000)} Gbit/s | {share} |")
    return lines


def digits(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


if __name__ == "__main__":
    main()
