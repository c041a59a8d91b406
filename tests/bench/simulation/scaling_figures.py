"""Writes the tables of docs/scaling.md from the benchmarks' JSON: `./stack bench fleet bandwidth --json FILE`.

FILE is docs/measured/scaling.json. Then:

    python tests/bench/simulation/scaling_figures.py

What stands between `<!-- NAME -->` and `<!-- end -->` is replaced.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE, FIGURES = DOCS / "scaling.md", DOCS / "measured" / "scaling.json"
PILOTS = 100


def main() -> None:
    figures = json.loads(FIGURES.read_text())
    PAGE.write_text(filled(PAGE.read_text(), figures))
    draw(figures["fleet"], DOCS / "fleet_cost.png")


def draw(rows: list[dict], file: Path) -> None:
    """Processor time of a world against the number of its robots, and the line where a core is full."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7.0, 3.6), dpi=110)
    for kind, colour in (("robotino", "#0a7fc2"), ("pepper", "#d4572f")):
        found = [(re.match(rf"{kind}: .* (\d+) in one world", row["metric"]), row) for row in rows]
        points = [(int(match[1]), row["ours"] * int(match[1]) / 1e3) for match, row in found if match]
        one = next(row["reference"] / 1e3 for match, row in found if match)
        count, cost = zip((1, one), *points, strict=True)
        axes.plot(count, cost, "o-", color=colour, label=f"{kind}s")
    axes.axhline(1.0, color="#444444", linestyle="--", linewidth=1.0)
    axes.text(1.0, 1.02, "one core is full: real time ends", color="#444444", va="bottom", fontsize=9)
    axes.set(xlabel="robots in one world", ylabel="processor seconds\nper second", ylim=(0.0, 1.2))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="lower right")
    figure.tight_layout()
    figure.savefig(file)
    pyplot.close(figure)


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
