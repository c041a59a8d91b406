"""The file that is copied to the robot runs there, without this project."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from telepresence.station import processes

pytestmark = pytest.mark.slow

ROBOT = Path(__file__).resolve().parents[3] / "catkin_ws" / "src" / "rto_bringup" / "robot"
NEEDED = {"drive": ("numpy",), "camera": (), "sound": ()}
"""Packages that a role may find; () for all but ours."""
SYSTEM = {"sound": ("gi",)}
"""What a role finds in the system's own Python: GStreamer's bindings do not come from PyPI."""
SYSTEM_PYTHON = Path("/usr/lib/python3/dist-packages")
ROLES = list(NEEDED)


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


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    """A folder with all packages but ours."""
    folder = tmp_path_factory.mktemp("packages")
    link_packages(folder, ())
    for package in SYSTEM["sound"]:
        (folder / package).symlink_to(SYSTEM_PYTHON / package)
    return folder


def link_packages(folder, wanted):
    for package in Path(sysconfig.get_paths()["purelib"]).iterdir():
        ours = package.name.startswith(("__editable__", "telepresence"))
        if not ours and (not wanted or package.name.partition(".")[0] in wanted):
            (folder / package.name).symlink_to(package)


def run_alone(*words, path=""):
    """What a Python without any packages but those in the folder `path` says."""
    environment = {**os.environ, "PYTHONPATH": str(path)}
    return subprocess.run(
        [sys.executable, "-S", *map(str, words)],
        env=environment, cwd="/", capture_output=True, text=True, timeout=60,
    )  # fmt: skip


@pytest.mark.parametrize("role", ROLES)
def test_explains_itself_where_nothing_is_installed(bundle, role):
    answer = run_alone(bundle, role, "--help")
    assert answer.returncode == 0 and "--port" in answer.stdout, answer.stderr


def test_every_module_in_it_finds_what_it_imports(bundle, everything):
    files = [name for name in zipfile.ZipFile(bundle).namelist() if name.endswith(".py") and "__main__" not in name]
    names = {name.removesuffix(".py").removesuffix("/__init__").replace("/", ".") for name in files}
    assert {"rto_bringup.onboard.sound_server", "telepresence.audio.pipeline", "rto_node.client"} <= names
    program = f"import sys; sys.path.insert(0, {str(bundle)!r}); import {', '.join(sorted(names))}"
    answer = run_alone("-c", program, path=everything)
    assert answer.returncode == 0, answer.stderr


def test_a_module_that_is_not_ours_is_not_packed(bundle):
    roots = {name.partition("/")[0] for name in zipfile.ZipFile(bundle).namelist()}
    assert roots == {"__main__.py", "rto_bringup", "rto_node", "telepresence"}


@pytest.mark.parametrize("role", ROLES)
def test_runs_where_only_its_requirements_are_installed(bundle, role, tmp_path, free_port):
    link_packages(tmp_path, NEEDED[role])
    for package in SYSTEM.get(role, ()):
        (tmp_path / package).symlink_to(SYSTEM_PYTHON / package)
    source = {
        "drive": ("--robot", f"127.0.0.1:{free_port()}"),
        "camera": ("--source", "test"),
        "sound": ("--microphone", "test", "--speaker", "none"),
    }[role]
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
