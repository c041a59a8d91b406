#!/usr/bin/env python3
"""Build robotvideo.pkg, the package that takes the part of the report's robotvideo on a Pepper with NAOqi 2.5.

    catkin_ws/src/telepresence_1/robot/make_package.py [--url http://10.0.0.10:10002/] [--output robotvideo.pkg]

A package is a zip file with manifest.xml at its root (NAOqi 2.8 documentation, PackageManager). This one has the
activity robotvideo/behaviour, which the robot's focus needs, and the service robotvideo.main, with those modules of
ours beside it that it needs.
"""

from __future__ import annotations

import argparse
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT))
from telepresence.station.robot_bundle import imports, modules  # noqa: E402

SOURCE = Path(__file__).resolve().parent / "robotvideo"
SCRIPT = SOURCE / "scripts" / "robotvideo.py"
PAGE_FILE = "page_url"
STAMP = (2020, 1, 1, 0, 0, 0)
"""Date and time of every file in the package, so that the same sources give the same package."""


def build(output: Path, url: str = "") -> None:
    """Write the package.

    Args:
        url: The page that the service keeps on the tablet by itself; "" leaves the page to com_cam.

    Raises:
        OSError: The file cannot be written.
    """
    contents = {
        path.relative_to(SOURCE).as_posix(): path.read_bytes()
        for path in sorted(SOURCE.rglob("*"))
        if path.is_file() and path.suffix in (".xml", ".pml", ".xar", ".py")
    }
    for path in modules(list(imports(SCRIPT.stem, SCRIPT)), [ROOT]).values():
        contents[f"scripts/{path.relative_to(ROOT).as_posix()}"] = path.read_bytes()
    if url:
        contents[PAGE_FILE] = f"{url}\n".encode()
    with zipfile.ZipFile(output, "w", zipfile.ZIP_DEFLATED) as package:
        for name, data in sorted(contents.items()):
            info = zipfile.ZipInfo(name, STAMP)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o755 if name.endswith(".py") else 0o644) << 16
            package.writestr(info, data)


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the package and print how to install it; return the exit status."""
    parser = argparse.ArgumentParser(description="Build robotvideo.pkg for a Pepper.")
    parser.add_argument("--url", default="", help="page that the robot's own service keeps on the tablet")
    parser.add_argument("--output", type=Path, default=Path("robotvideo.pkg"), help="default: %(default)s")
    options = parser.parse_args(arguments)
    try:
        build(options.output, options.url)
    except OSError as error:
        print(f"make_package.py: {error}", file=sys.stderr)
        return 1
    name = options.output.name
    print(
        f"{options.output} is built. To install and to start it:\n"
        f"  scp {options.output} nao@ROBOT:\n"
        f"  ssh nao@ROBOT qicli call PackageManager.install /home/nao/{name}\n"
        "  ssh nao@ROBOT qicli call ALServiceManager.startService robotvideo.main"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
