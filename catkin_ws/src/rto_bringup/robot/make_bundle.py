#!/usr/bin/env python3
"""Packs what runs on the robot into one file, robotino_onboard.pyz, to be copied there: see docs/robotino.md.

    python3 catkin_ws/src/rto_bringup/robot/make_bundle.py [FOLDER]

The file holds our own modules only: those of rto_bringup.onboard and all that they import. The packages that they need
from elsewhere are in requirements.txt. Beside it lies robot.key, without which nobody drives the robot, sees through
its camera or talks through it: a new key the first time, shown once; afterwards it is kept.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import zipapp
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[3]
sys.path.insert(0, str(ROOT))
from telepresence.station.robot_bundle import (  # noqa: E402  works in a checkout that is not installed
    is_package,
    modules,
    modules_of,
    provide_key,
)

SOURCES = (ROOT, ROOT / "catkin_ws/src/rto_node/src", ROOT / "catkin_ws/src/rto_bringup/src")
"""Where our modules are."""
PROGRAMS = "rto_bringup.onboard"
BESIDE = ("requirements.txt", "robotino-onboard@.service", "drive-watchdog.conf")
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
        for name, source in modules(modules_of(PROGRAMS, SOURCES), SOURCES).items():
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


if __name__ == "__main__":
    sys.exit(main())
