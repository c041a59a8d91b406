"""The file that is copied to the robot runs there, without this project beside it."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from telepresence.station import processes

ROBOT = Path(__file__).resolve().parents[3] / "catkin_ws" / "src" / "rto_bringup" / "robot"
NEEDED = {"drive": ("numpy",), "camera": ()}
"""Packages that a role may find; () for all but ours."""


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robot") / "onboard"
    subprocess.run([sys.executable, str(ROBOT / "make_bundle.py"), str(folder)], check=True, capture_output=True)
    assert {path.name for path in folder.iterdir()} == {
        "robotino_onboard.pyz",
        "requirements.txt",
        "robotino-onboard@.service",
    }
    return folder / "robotino_onboard.pyz"


@pytest.mark.parametrize("role", NEEDED)
def test_runs_where_only_its_requirements_are_installed(bundle, role, tmp_path, free_port):
    for package in Path(sysconfig.get_paths()["purelib"]).iterdir():
        ours = package.name.startswith(("__editable__", "telepresence"))
        if not ours and (not NEEDED[role] or package.name.partition(".")[0] in NEEDED[role]):
            (tmp_path / package.name).symlink_to(package)
    source = {"drive": ("--robot", f"127.0.0.1:{free_port()}"), "camera": ("--source", "test")}[role]
    program = processes.start(
        [sys.executable, "-S", str(bundle), role, "--port", "0", *source],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        cwd="/",
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert "listens on" in program.stdout.readline(), program.communicate(timeout=10)[1]
    finally:
        assert processes.end(program, patience=10.0) == 0
        program.stdout.close()
        program.stderr.close()


def test_requirements_are_the_versions_tested_here():
    wanted = dict(
        line.split("==") for line in (ROBOT / "requirements.txt").read_text().splitlines() if not line.startswith("#")
    )
    setup = (ROBOT.parents[3] / "setup.py").read_text()
    assert set(wanted) == {"numpy", "aiortc", "aiohttp"}
    for name, version in wanted.items():
        assert f'"{name}=={version}"' in setup
