#!/usr/bin/env python3
"""Makes the one file that runs on a Pepper, drive_server.py, and its key: see docs/pepper.md.

    python3 catkin_ws/src/naoqi_driver_py/robot/make_drive_server.py [FOLDER]

The file is a plain script for the robot's own Python 2.7, which holds our modules as text: NAOqi's autoload.ini starts
scripts. Beside it lies robot.key, without which nobody drives the robot over a network: a new key the first time, shown
once; afterwards it is kept.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT))
from telepresence.station.robot_bundle import imports, is_package, modules, provide_key  # noqa: E402

SOURCES = (ROOT, ROOT / "catkin_ws/src/naoqi_driver_py/src")
"""Where our modules are."""
PROGRAM = "naoqi_driver.onboard.drive_program"
NAME, KEY = "drive_server.py", "robot.key"
HEAD = '''\
#!/usr/bin/env python
# Runs on the robot's own Python 2.7 as well as on Python 3. Made by make_drive_server.py; changes belong there.
"""Pepper's drive server: the only program that moves its base. Use, on the robot: python drive_server.py --help"""

import sys
import types

SOURCES = []


def load():
    for name, package, text in SOURCES:
        module = types.ModuleType(name)
        sys.modules[name] = module
        module.__file__ = __file__ + "/" + name
        if package:
            module.__path__ = []
        parent, _, last = name.rpartition(".")
        if parent:
            setattr(sys.modules[parent], last, module)
        exec(compile(text, module.__file__, "exec", 0, True), module.__dict__)


'''
TAIL = f'''
if __name__ == "__main__":
    load()
    sys.exit(sys.modules["{PROGRAM}"].main(sys.argv[1:]))
'''


def main(arguments: list[str] | None = None) -> int:
    """Write the file and the key; the exit status."""
    parser = argparse.ArgumentParser(description="Make the one file that runs on a Pepper.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("pepper_onboard"), help="made if it is missing")
    parser.add_argument("--new-key", action="store_true", help="make another key, in place of the one in the folder")
    options = parser.parse_args(arguments)
    folder = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    (folder / NAME).write_text(one_file())
    try:
        said = provide_key(folder / KEY, options.new_key)
    except (OSError, ValueError) as error:
        print(f"make_drive_server: {error}", file=sys.stderr)
        return 1
    print(f"{folder / NAME} and {KEY}: copy the folder to the robot")
    print(said)
    return 0


def one_file() -> str:
    """Return the text of the program."""
    found = modules([PROGRAM], SOURCES)
    parts = [HEAD]
    for name in in_order(found):
        lines = "\n".join(f"    {json.dumps(line)}" for line in found[name].read_text().splitlines(keepends=True))
        parts.append(f'SOURCES.append(("{name}", {is_package(found[name])}, (\n{lines}\n)))\n')
    return "".join([*parts, TAIL])


def in_order(found: dict[str, Path]) -> list[str]:
    """Return the names so that each module comes after its package and after what it imports."""
    ordered: list[str] = []

    def add(name: str) -> None:
        if name in ordered or name not in found:
            return
        add(name.rpartition(".")[0])
        for each in imports(name, found[name]):
            if each != name:
                add(each)
        if name not in ordered:
            ordered.append(name)

    for name in found:
        add(name)
    return ordered


if __name__ == "__main__":
    sys.exit(main())
