"""The folder alone, as a wheel or copied under another name, is a client and a server: nothing else is needed."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "telepresence" / "naoqi"
PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
import {package} as qi

class Greeter:
    def greet(self, name: str) -> str:
        return "hello " + name

robot, client = qi.Session(), qi.Session()
robot.listenStandalone("tcp://127.0.0.1:0")
robot.registerService("Greeter", Greeter())
client.connect(robot.endpoints()[0])
print(client.service("Greeter").greet("world"))
client.close()
robot.close()
assert "numpy" not in sys.modules
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What pip makes of a copy: it builds where it finds the folder."""
    folder = tmp_path_factory.mktemp("wheel")
    shutil.copytree(FOLDER, folder / "source", ignore=shutil.ignore_patterns("__pycache__", "build", "*.egg-info"))
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--wheel-dir", folder, folder / "source"], check=True, timeout=100)
    (file,) = folder.glob("*.whl")
    return file


def test_the_wheel_has_the_package_and_nothing_else(wheel: Path):
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
        (metadata,) = (archive.read(name).decode() for name in archive.namelist() if name.endswith("/METADATA"))
    assert names == {f"telepresence/naoqi/{file.name}" for file in [*FOLDER.glob("*.py"), FOLDER / "py.typed"]}
    assert "Requires-Dist" not in metadata and "Requires-Python: >=3.9" in metadata


@pytest.mark.parametrize("package", ["telepresence.naoqi", "wire_of_my_robot"])
def test_client_and_server_need_nothing_else(package: str, wheel: Path, tmp_path: Path):
    if package == "telepresence.naoqi":
        zipfile.ZipFile(wheel).extractall(tmp_path)
    else:
        shutil.copytree(FOLDER, tmp_path / package)
    # -I -S: neither this project nor any installed package is there to be found.
    command = [sys.executable, "-I", "-S", "-c", PROGRAM.format(package=package), str(tmp_path)]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=tmp_path)
    assert (answer.returncode, answer.stdout) == (0, "hello world\n"), answer.stderr


def test_version_and_licence_are_the_projects():
    ours = tomllib.loads((FOLDER / "pyproject.toml").read_text())["project"]
    assert ours["version"] == re.search(r'version="([^"]+)"', (ROOT / "setup.py").read_text())[1]
    assert (FOLDER / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()
