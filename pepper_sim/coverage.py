"""Writes docs/naoqi_coverage.md: every documented method of every service, and what the simulated robot makes of it.

    python -m pepper_sim.coverage             writes the page
    python -m pepper_sim.coverage --check     says whether it is up to date
    python -m pepper_sim.coverage --missing   lists what is documented for Pepper and not declared by the robot

The page is made of `documented/`; tests/pepper_sim/test_documented_methods.py calls every method that stands there.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

from pepper_sim.documentation import INHERITED, Method, ServiceDocumentation, read_all
from pepper_sim.naoqi.catalogue import service_classes
from pepper_sim.naoqi.service import Service

PAGE = Path(__file__).resolve().parents[1] / "docs" / "naoqi_coverage.md"
_WORDS = {"does": "does it", "refuses": "refuses", "cannot": "cannot here"}
_HEAD = """\
# What is documented, and what the simulated Pepper does

Made by `./stack exec python -m pepper_sim.coverage` from `pepper_sim/documented/`: NAOqi documentation 2.8 and 2.5.
`tests/pepper_sim/test_documented_methods.py`, and its neighbour for those that take time, call every method below with
valid and invalid arguments and compare types, times and errors.

*does it*: with the documented effect in the simulated world, where it has one. *refuses*: with an error, as Pepper
does. *cannot here*: what no simulated robot has. Methods for the two-legged robot are listed, and not counted.
"""


def percentage(documented: Mapping[str, ServiceDocumentation]) -> float:
    """Return how much of what is documented for Pepper the simulated robot does [%]."""
    counts = _count(method for service in documented.values() for method in service.methods)
    total = sum(counts[answer] for answer in _WORDS)
    return 100.0 * counts["does"] / total if total else 0.0


def page(documented: Mapping[str, ServiceDocumentation]) -> str:
    """Return the page as Markdown."""
    counts = _count(method for service in documented.values() for method in service.methods)
    lines = [
        _HEAD,
        f"**{percentage(documented):.1f} % of the methods that are documented for Pepper are implemented.**",
        "",
    ]
    lines += ["| service | methods | does it | refuses | cannot here | two-legged only |", "|---|--:|--:|--:|--:|--:|"]
    for service in documented.values():
        lines.append(_row(f"[{service.service}](#{service.service.lower()})", _count(service.methods)))
    lines += [_row("together", counts), ""]
    for service in documented.values():
        lines += _section(service)
    return "\n".join(lines).rstrip() + "\n"


def missing(documented: Mapping[str, ServiceDocumentation], services: Iterable[Service]) -> list[str]:
    """Return "Service.method" for what is documented for Pepper, can be done here and is not declared."""
    declared = {service.name: {binding.name for binding in service.bindings()} for service in services}
    return [
        f"{service.service}.{method.name}"
        for service in documented.values()
        if service.service not in INHERITED
        for method in service.methods
        if method.counted and method.answer != "cannot" and method.name not in declared.get(service.service, ())
    ]


def undocumented(documented: Mapping[str, ServiceDocumentation]) -> list[str]:
    """Return the services of the robot that no file describes."""
    return [service.name for service in service_classes() if service.name not in documented]


def _count(methods: Iterable[Method]) -> Counter[str]:
    return Counter(method.answer if method.counted else "nao" for method in methods)


def _row(name: str, counts: Counter[str]) -> str:
    total = sum(counts[answer] for answer in _WORDS)
    cells = [name, total, *(counts[answer] for answer in _WORDS), counts["nao"]]
    return "| " + " | ".join(map(str, cells)) + " |"


def _section(service: ServiceDocumentation) -> list[str]:
    lines = [f"## {service.service}", "", ", ".join(f"`{name}`" for name in service.pages), ""]
    lines += ["| method | documented in | answer |", "|---|---|---|"]
    for method in service.methods:
        answer = _WORDS[method.answer] + (f": {method.why}" if method.why else "")
        robot = "" if method.counted else ", two-legged only"
        lines.append(f"| `{method.name}` | {', '.join(method.releases)}{robot} | {answer} |")
    return [*lines, ""]


def main(arguments: list[str] | None = None) -> int:
    """Write or check the page, or list what is missing; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="say whether the page is up to date")
    parser.add_argument(
        "--missing", action="store_true", help="list documented methods that the robot does not declare"
    )
    options = parser.parse_args(arguments)
    documented = read_all()
    if options.missing:
        from pepper_sim.simulation import Simulation

        with contextlib.closing(Simulation(scene="empty", port=0)) as simulation:
            services = simulation.server.catalogue.services
            print(*missing(documented, services), sep="\n")
        print(*(f"{name}: no file in pepper_sim/documented" for name in undocumented(documented)), sep="\n")
        return 0
    text = page(documented)
    if options.check:
        if PAGE.is_file() and PAGE.read_text() == text:
            return 0
        print(f"{PAGE.name} is not what the files say:  ./stack exec python -m pepper_sim.coverage", file=sys.stderr)
        return 1
    PAGE.write_text(text)
    print(f"{PAGE}: {percentage(documented):.1f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
