"""What a program for a robot consists of: our modules that it needs, and the robot's key beside it.

Standard library only: bundles are made in a checkout that is not installed, too.
"""

from __future__ import annotations

import ast
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from telepresence.security.robot_key import RobotKey


def provide_key(path: Path, new: bool = False) -> str:
    """Make the robot's key, unless it is there and is to be kept; what to say about it.

    Raises:
        OSError, ValueError: The key that is there cannot be used, or none can be written.
    """
    if new:
        path.unlink(missing_ok=True)
    if os.path.lexists(path):
        return f"The robot's key {RobotKey.read(path).fingerprint} is kept ({path}; --new-key makes another one)."
    key = RobotKey.make(path)
    return (
        f"The robot's key {key.fingerprint} is new, in {path}; whoever has it drives the robot. Shown this once:\n"
        f"    {key.text}\n"
        f"On each pilot's computer:  ./stack pair ROBOT --file {path}  or type it after  ./stack pair ROBOT"
    )


def modules_of(package: str, sources: Sequence[Path]) -> list[str]:
    """Return the names of the modules in a package.

    Raises:
        ModuleNotFoundError: There is no such package.
    """
    start = find(package, sources)
    if start is None:
        raise ModuleNotFoundError(f"there is no package {package} in {', '.join(map(str, sources))}")
    return [f"{package}.{path.stem}" for path in start.parent.glob("*.py") if not is_package(path)]


def modules(names: Sequence[str], sources: Sequence[Path]) -> dict[str, Path]:
    """Return these modules of ours and all that they import, each with its file.

    Args:
        sources: Folders where our modules are.
    """
    waiting = list(names)
    found: dict[str, Path] = {}
    while waiting:
        name = waiting.pop()
        if not name or name in found or (path := find(name, sources)) is None:
            continue
        found[name] = path
        waiting += [name.rpartition(".")[0], *imports(name, path)]
    return found


def find(name: str, sources: Sequence[Path]) -> Path | None:
    """Return the file of one of our modules or packages; None for other names."""
    for base in sources:
        path = base.joinpath(*name.split("."))
        for candidate in (path / "__init__.py", path.with_suffix(".py")):
            if candidate.is_file():
                return candidate
    return None


def is_package(path: Path) -> bool:
    """Return whether a module's file is that of a package."""
    return path.name == "__init__.py"


def imports(name: str, path: Path) -> Iterator[str]:
    """Yield the names that a module imports, also those that it imports inside of a function."""
    package = name if is_package(path) else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")
            base = ".".join(parents[: len(parents) - node.level + 1]) if node.level else ""
            origin = ".".join(filter(None, (base, node.module)))
            yield origin
            yield from (f"{origin}.{alias.name}" for alias in node.names)  # each may be a module
