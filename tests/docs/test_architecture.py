"""The tables in docs/architecture.md, of time-outs and periods and of who watches whom, say what the code says.

Each row names a constant: a module, and behind it a name, a field of a class or an attribute of an object. What stands
in the file as a number is read without importing it, so that scripts of the robot and ROS nodes can be looked up too.
"""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "architecture.md"
FOLDERS = [ROOT, *(path for name in ("src", "nodes", "robot") for path in ROOT.glob(f"catkin_ws/src/*/{name}"))]
"""Where a module may begin: the repository, and the packages, nodes and on-robot programs of every ROS package."""
UNITS = {"s": lambda value: value, "ms": lambda value: value / 1000.0, "Hz": lambda value: 1.0 / value}
TIMING = re.compile(r"TIMEOUT|PERIOD|PATIENCE|_AFTER|TIME$|SILEN|WATCHDOG|AGE$")


class Row(NamedTuple):
    """A row of the table: what the page says, and the constant that must say the same."""

    seconds: float
    name: str
    unit: str


def _rows() -> list[Row]:
    table = PAGE.read_text().partition("<!-- timing -->")[2].partition("<!-- end -->")[0]
    rows = []
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if found := re.fullmatch(r"`([\w.]+)`(?: \((ms|Hz)\))?", cells[3] if len(cells) > 3 else ""):
            rows.append(Row(float(cells[2]), found[1], found[2] or "s"))
    return rows


ROWS = _rows()


class Watch(NamedTuple):
    """A row of who watches whom: how long the page says, and the terms whose sum it must be."""

    who: str
    whom: str
    seconds: float
    terms: str


TERM = re.compile(r"(?:([\d.]+) × )?`([^`]+)`(?: \((ms|Hz)\))?")


def _watches() -> list[Watch]:
    table = PAGE.read_text().partition("<!-- watching -->")[2].partition("<!-- end -->")[0].strip()
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]
    return [Watch(cells[0], cells[1], float(cells[3]), cells[4]) for cells in lines]


WATCHES = _watches()


def test_the_table_is_found_and_every_row_names_a_constant():
    table = PAGE.read_text().partition("<!-- timing -->")[2].partition("<!-- end -->")[0].strip().splitlines()
    assert len(ROWS) == len(table) - 2 > 60


def test_no_constant_stands_in_two_rows():
    names = [row.name for row in ROWS]
    assert sorted(names) == sorted(set(names))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_the_page_gives_the_constant_of_the_code(row: Row):
    assert UNITS[row.unit](_value(row.name)) == pytest.approx(row.seconds, rel=0.01)


@pytest.mark.parametrize("watch", WATCHES, ids=lambda watch: f"{watch.who} -> {watch.whom}".replace("`", ""))
def test_who_watches_whom_waits_as_long_as_the_page_says(watch: Watch):
    terms = watch.terms.split(" + ")
    matches = [TERM.fullmatch(term) for term in terms]
    assert all(matches), f"{watch.terms} is no sum of constants"
    total = sum(float(found[1] or 1) * UNITS[found[3] or "s"](_value(found[2])) for found in matches if found)
    assert total == pytest.approx(watch.seconds, rel=0.01)


def test_nobody_who_watches_stands_twice_for_the_same_constant():
    assert len(WATCHES) > 30
    rows = [(watch.who, watch.whom, watch.terms) for watch in WATCHES]
    assert sorted(set(rows)) == sorted(rows)


def test_a_name_that_is_gone_is_an_error_that_names_what_there_is():
    with pytest.raises(LookupError, match=r"base.py has no PERIO; .*PERIOD"):
        _value("naoqi_driver.base.PERIO")
    with pytest.raises(LookupError, match="no module"):
        _value("naoqi_driver.bass.PERIOD")
    with pytest.raises(LookupError, match="no unit"):
        _value("robotino-onboard@.service RestartSecs")


def _value(name: str) -> float:
    """The number behind a dotted name.

    Raises:
        LookupError: There is no such module, or nothing of that name in it.
    """
    if " " in name:
        return _of_unit(*name.split(" "))
    file, module, attributes = _module_of(name)
    found = _literal(ast.parse(file.read_text()).body, attributes)
    if found is not None:
        return found
    names = _names(file)
    if attributes[0] not in names:
        timing = sorted(each for each in names if TIMING.search(each))
        raise LookupError(f"{file.relative_to(ROOT)} has no {attributes[0]}; it has {', '.join(timing)}")
    value = importlib.import_module(module)
    for attribute in attributes:
        value = value[attribute] if isinstance(value, dict) else getattr(value, attribute)
    return float(value)


def _of_unit(name: str, setting: str) -> float:
    """The seconds of a setting of a systemd unit."""
    files = [path for folder in ("catkin_ws/src", "telepresence") for path in (ROOT / folder).rglob(name)]
    for file in files:
        if found := re.search(rf"^{setting}=([\d.]+)(ms|s)?$", file.read_text(), re.MULTILINE):
            return float(found[1]) / (1000.0 if found[2] == "ms" else 1.0)
    raise LookupError(f"no unit {name} with {setting}; there are {files}")


def _module_of(name: str) -> tuple[Path, str, list[str]]:
    """File and name of the module that a dotted name begins with, and the rest of the name."""
    parts = name.split(".")
    for length in range(len(parts) - 1, 0, -1):
        files = [folder.joinpath(*parts[:length]).with_suffix(".py") for folder in FOLDERS]
        files = [file for file in files if file.is_file()]
        if len(files) > 1:
            raise LookupError(f"{name} is ambiguous: {', '.join(map(str, files))}")
        if files:
            return files[0], ".".join(parts[:length]), parts[length:]
    raise LookupError(f"no module of {name} is found")


def _literal(body: list[ast.stmt], attributes: list[str]) -> float | None:
    """The number that is assigned to a name, or to a field of a class, in so many words; else None."""
    first, *rest = attributes
    for statement in body:
        if rest and isinstance(statement, ast.ClassDef) and statement.name == first:
            return _literal(statement.body, rest)
        if not rest:
            for target, value in _assignments(statement):
                if target == first and isinstance(value, ast.Constant) and isinstance(value.value, int | float):
                    return float(value.value)
    return None


def _names(file: Path) -> set[str]:
    body = ast.parse(file.read_text()).body
    classes = {statement.name for statement in body if isinstance(statement, ast.ClassDef)}
    return classes | {name for statement in body for name, _ in _assignments(statement)}


def _assignments(statement: ast.stmt) -> list[tuple[str, ast.expr]]:
    """Names and what is assigned to them; of `A, B = 1, 2` both."""
    if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name) and statement.value:
        return [(statement.target.id, statement.value)]
    if not isinstance(statement, ast.Assign):
        return []
    found = []
    for target in statement.targets:
        if isinstance(target, ast.Name):
            found.append((target.id, statement.value))
        elif isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple):
            pairs = zip(target.elts, statement.value.elts, strict=True)
            found += [(name.id, value) for name, value in pairs if isinstance(name, ast.Name)]
    return found
