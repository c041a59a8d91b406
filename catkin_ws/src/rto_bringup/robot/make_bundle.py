#!/usr/bin/env python3
"""Packs what runs on the robot into one file, robotino_onboard.pyz, to be copied there: see docs/robotino.md.

    python3 catkin_ws/src/rto_bringup/robot/make_bundle.py [FOLDER]

The file holds our own modules only. NumPy, and for the camera aiortc and aiohttp, come from the robot's own Python.
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
CONTENTS = {
    ROOT: (
        "telepresence/__init__.py",
        "telepresence/video/__init__.py",
        "telepresence/video/images.py",
        "telepresence/video/frame_timestamp.py",
        "telepresence/video/webrtc.py",
        "telepresence/safety",
    ),
    ROOT / "catkin_ws/src/rto_node/src": (
        "rto_node/__init__.py",
        "rto_node/client.py",
        "rto_node/drive_datagram.py",
    ),
    ROOT / "catkin_ws/src/rto_bringup/src": ("rto_bringup/__init__.py", "rto_bringup/onboard"),
}
BESIDE = ("requirements.txt", "robotino-onboard@.service")
NAME = "robotino_onboard.pyz"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Pack what runs on the robot into one file.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("robotino_onboard"), help="made if it is missing")
    folder = parser.parse_args(arguments).folder
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        for base, names in CONTENTS.items():
            for name in names:
                copy(base / name, Path(scratch) / name)
        (Path(scratch) / "__main__.py").write_text(
            "import sys\n\nfrom rto_bringup.onboard.__main__ import main\n\nsys.exit(main())\n"
        )
        zipapp.create_archive(scratch, folder / NAME, "/usr/bin/env python3", compressed=True)
    for name in BESIDE:
        shutil.copy(HERE / name, folder)
    print(f"{folder / NAME} and {', '.join(BESIDE)}: copy the folder to the robot")
    return 0


def copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
    else:
        shutil.copy(source, target)


if __name__ == "__main__":
    sys.exit(main())
