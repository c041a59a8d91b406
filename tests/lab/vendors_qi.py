"""Tests that need the vendor's `qi`, where the vendor has none for a machine; tests/conftest.py registers this plugin.

There are wheels of `qi` for x86_64 and Python up to 3.12 (setup.py asks for it under that condition). Elsewhere what
needs it is left out, and the summary says what: files that import it at their top, and tests marked `vendor`, which
import it themselves. Where there is a wheel nothing is left out, whether it is installed or not.
"""

from __future__ import annotations

import ast
import platform
import sys
from pathlib import Path
from typing import Any

import pytest

THERE_IS_ONE = platform.machine() == "x86_64" and sys.version_info < (3, 13)
LEFT_OUT = pytest.StashKey[dict[str, int]]()
"""File -> how many of its tests are left out, 0: the whole file."""


def pytest_configure(config: pytest.Config) -> None:
    config.stash[LEFT_OUT] = {}


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    if THERE_IS_ONE or collection_path.suffix != ".py" or not _imports_it(collection_path.read_text()):
        return None  # nothing to say: other plugins decide
    config.stash[LEFT_OUT][_name(collection_path, config)] = 0
    return True


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if THERE_IS_ONE:
        return
    left_out = [item for item in items if item.get_closest_marker("vendor")]
    for item in left_out:
        file = _name(item.path, config)
        config.stash[LEFT_OUT][file] = config.stash[LEFT_OUT].get(file, 0) + 1
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if item not in left_out]


def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["left_out"] = session.config.stash[LEFT_OUT]


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """A worker of pytest-xdist has ended; each of them has collected everything."""
    node.config.stash[LEFT_OUT].update(getattr(node, "workeroutput", {}).get("left_out", {}))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    if left_out := config.stash[LEFT_OUT]:
        terminalreporter.section("not for this machine")
        this = f"{platform.machine()}, Python {platform.python_version()}"
        terminalreporter.line(f"These need the vendor's qi (x86_64, Python up to 3.12), and this is {this}:")
        for file, tests in sorted(left_out.items()):
            terminalreporter.line(f"  {file}: {f'{tests} of its tests' if tests else 'the whole file'}")


def _imports_it(text: str) -> bool:
    """Whether a file does so at its top, not somewhere in a function or in the text of a program."""
    return "import qi" in text and any(
        isinstance(node, ast.Import) and any(alias.name == "qi" for alias in node.names)
        for node in ast.parse(text).body
    )


def _name(path: Path, config: pytest.Config) -> str:
    return str(path.relative_to(config.rootpath)) if path.is_relative_to(config.rootpath) else str(path)
