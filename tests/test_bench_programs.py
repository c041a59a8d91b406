"""Programs that benchmarks start by their path find what they import: there is no folder of benchmarks on theirs."""

from __future__ import annotations

import ast
import sys
from importlib.machinery import PathFinder
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
PROGRAMS = [
    path
    for path in sorted((TESTS / "bench").glob("*/*.py"))
    if '__name__ == "__main__"' in (text := path.read_text()) and "sys.path" not in text
]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_program_finds_what_it_imports(program):
    found_in = [str(program.parent), *(place for place in sys.path if not Path(place).is_relative_to(TESTS))]
    tree = ast.parse(program.read_text())
    imported = {alias.name for node in tree.body if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module or "" for node in tree.body if isinstance(node, ast.ImportFrom)}
    names = {name.partition(".")[0] for name in imported} - sys.stdlib_module_names
    assert [name for name in names if PathFinder.find_spec(name, found_in) is None] == []
