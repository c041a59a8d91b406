#!/usr/bin/env python3
"""Packs what runs on the robot into one file, robotino_onboard.pyz, to be copied there: see docs/robotino.md.

    python3 catkin_ws/src/rto_bringup/robot/make_bundle.py [FOLDER]

The file holds our own modules only: those of rto_bringup.onboard and all that they import. The packages that they need
from elsewhere are in requirements.txt. Beside it lies robot.key, without which nobody drives the robot, sees through
its camera or talks through it: a new key the first time, shown once; afterwards it is kept.
"""

from __future__ import annotations

import argparse
import ast
import os
import shutil
import sys
import tempfile
import zipapp
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[3]
sys.path.insert(0, str(ROOT))
from telepresence.security.robot_key import RobotKey  # noqa: E402  works in a checkout that is not installed

SOURCES = (ROOT, ROOT / "catkin_ws/src/rto_node/src", ROOT / "catkin_ws/src/rto_bringup/src")
"""Where our modules are."""
PROGRAMS = "rto_bringup.onboard"
BESIDE = ("requirements.txt", "robotino-onboard@.service")
NAME = "robotino_onboard.pyz"
KEY = "robot.key"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Pack what runs on the robot into one file.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("robotino_onboard"), help="made if it is missing")
    parser.add_argument("--new-key", action="store_true", help="make another key, in place of the one in the folder")
    options = parser.parse_args(arguments)
    folder = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        for name, source in modules(PROGRAMS).items():
            target = Path(scratch, *name.split("."))
            target = target / "__init__.py" if is_package(source) else target.with_suffix(".py")
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)
        (Path(scratch) / "__main__.py").write_text(
            "import sys\n\nfrom rto_bringup.onboard.__main__ import main\n\nsys.exit(main())\n"
        )
        zipapp.create_archive(scratch, folder / NAME, "/usr/bin/env python3", compressed=True)
    for name in BESIDE:
        shutil.copy(HERE / name, folder)
    try:
        said = provide_key(folder / KEY, options.new_key)
    except (OSError, ValueError) as error:
        print(f"make_bundle: {error}", file=sys.stderr)
        return 1
    print(f"{folder / NAME}, {', '.join(BESIDE)} and {KEY}: copy the folder to the robot")
    print(said)
    return 0


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


def modules(package: str) -> dict[str, Path]:
    """Return our modules that belong to `package` or are imported by one that does, each with its file."""
    start = find(package)
    if start is None:
        raise ModuleNotFoundError(f"there is no package {package} in {', '.join(map(str, SOURCES))}")
    waiting = [f"{package}.{path.stem}" for path in start.parent.glob("*.py") if not is_package(path)]
    found: dict[str, Path] = {}
    while waiting:
        name = waiting.pop()
        if not name or name in found or (path := find(name)) is None:
            continue
        found[name] = path
        waiting += [name.rpartition(".")[0], *imports(name, path)]
    return found


def find(name: str) -> Path | None:
    """Return the file of one of our modules or packages; None for other names."""
    for base in SOURCES:
        path = base.joinpath(*name.split("."))
        for candidate in (path / "__init__.py", path.with_suffix(".py")):
            if candidate.is_file():
                return candidate
    return None


def is_package(path: Path) -> bool:
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


if __name__ == "__main__":
    sys.exit(main())
