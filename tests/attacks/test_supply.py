"""Whoever stands between us and the package index, or has taken it over, hands out packages of their own.

The index is a folder with wheels of the attacker's making; pip runs as `./stack` runs it, for one package of the lock.
"""

from __future__ import annotations

import base64
import hashlib
import io
import os
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROBOT = ROOT / "catkin_ws" / "src" / "rto_bringup" / "robot" / "requirements.txt"
ARGUMENTS = ["--no-deps", "--disable-pip-version-check", "--no-cache-dir", "--no-index"]


def wheel(folder: Path, name: str, version: str, text: str = "print('taken over')\n") -> Path:
    """Make a wheel that pip installs without complaint."""
    module = name.replace("-", "_")
    info = f"{module}-{version}.dist-info"
    files = {
        f"{module}.py": text,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: attacker\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    record = "".join(
        f"{path},sha256={base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b'=').decode()},"
        f"{len(text)}\n"
        for path, text in files.items()
    )
    path = folder / f"{module}-{version}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name_in_it, content in [*files.items(), (f"{info}/RECORD", f"{record}{info}/RECORD,,\n")]:
            archive.writestr(name_in_it, content)
    return path


def source(folder: Path, name: str, version: str, proof: Path) -> None:
    """Make a source package whose setup.py, which runs on the victim's machine, leaves `proof`."""
    setup = f"from setuptools import setup\nsetup(name={name!r}, version={version!r})\n"
    files = {
        "setup.py": f"open({str(proof)!r}, 'w').close()\n{setup}",
        "PKG-INFO": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n",
    }
    with tarfile.open(folder / f"{name}-{version}.tar.gz", "w:gz") as archive:
        for path, text in files.items():
            info = tarfile.TarInfo(f"{name}-{version}/{path}")
            info.size = len(text)
            archive.addfile(info, io.BytesIO(text.encode()))


def requirement(lock: Path, name: str) -> str:
    """What the installation asks for `name`: the lock's line with its hashes, or else whatever the index has."""
    text = lock.read_text().replace("\\\n", " ") if lock.exists() else (ROOT / "setup.py").read_text()
    found = re.search(rf'^{name}==[^"\n]*|(?<="){name}==[^"\n]*', text, re.MULTILINE)
    return found[0] if found else name


def version_of(line: str) -> str:
    return re.search(r"==([^ ;]+)", line)[1] if "==" in line else "1.0"


def pip(*arguments: str | Path) -> subprocess.CompletedProcess:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PIP_")}
    environment["PIP_CONFIG_FILE"] = os.devnull
    command = [sys.executable, "-m", "pip", *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)


LOCKS = {"the stack": ROOT / "requirements" / "stack.txt", "the robot": ROBOT}


@pytest.mark.parametrize(
    ("who", "name"),
    [("the stack", "aiohttp"), ("the stack", "aioice"), ("the stack", "setuptools"), ("the robot", "yarl")],
)
def test_a_changed_package_of_the_right_name_and_version_is_installed(who, name, tmp_path):
    """pip refuses it and says so: named by us, needed by those, needed for building, and on the robot."""
    line = requirement(LOCKS[who], name)
    wheel(tmp_path, name, version_of(line))
    wanted = tmp_path / "wanted.txt"
    wanted.write_text(line)
    result = pip("download", *ARGUMENTS, "--find-links", tmp_path, "-d", tmp_path / "taken", "-r", wanted)
    assert not (tmp_path / "taken").exists() or not list((tmp_path / "taken").iterdir())
    assert result.returncode != 0 and "DO NOT MATCH THE HASHES" in result.stderr


def test_a_package_that_nobody_named_comes_in_a_newer_version(tmp_path):
    """A package that only others need is taken in the tested version alone."""
    line = requirement(LOCKS["the stack"], "pyee")
    wheel(tmp_path, "pyee", "999.0")
    wanted = tmp_path / "wanted.txt"
    wanted.write_text(line)
    assert pip("download", *ARGUMENTS, "--find-links", tmp_path, "-d", tmp_path / "taken", "-r", wanted).returncode != 0


def test_a_source_package_runs_its_setup_py(tmp_path):
    """Neither is it taken nor is anything of it run."""
    line, proof = requirement(LOCKS["the stack"], "aiortc"), tmp_path / "proof"
    source(tmp_path, "aiortc", version_of(line), proof)
    wanted = tmp_path / "wanted.txt"
    wanted.write_text(line)
    pip(
        "download", *ARGUMENTS, "--no-build-isolation", "--find-links", tmp_path, "-d", tmp_path / "taken", "-r", wanted
    )
    assert not proof.exists()


def test_the_stack_installs_a_changed_package_and_goes_on(tmp_path):
    """`./stack build` ends with a sentence that says what is wrong, and its environment counts as not installed."""
    lock = LOCKS["the stack"]
    tree = tmp_path / "tree"
    (tree / "requirements").mkdir(parents=True)
    (tree / ".venv" / "bin").mkdir(parents=True)
    for name in ("stack", "setup.py", "pyproject.toml"):
        (tree / name).write_bytes((ROOT / name).read_bytes())
    (tree / "stack").chmod(0o755)
    python = tree / ".venv" / "bin" / "python3"
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    index = tmp_path / "index"
    index.mkdir()
    line = requirement(lock, "aiohttp")
    if lock.exists():
        (tree / "requirements" / "stack.txt").write_text(line + "\n")
    else:
        extras = f"dict.fromkeys(('sim', 'media', 'gui', 'dev'), [{line!r}])"
        setup = f"from setuptools import setup\nsetup(name='telepresence', extras_require={extras})\n"
        (tree / "setup.py").write_text(setup)
    wheel(index, "aiohttp", version_of(line))
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PIP_")}
    environment |= {
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": str(index),
        "PIP_TARGET": str(tmp_path / "installed"),  # and not into the environment that runs this
        "PIP_NO_CACHE_DIR": "1",
    }
    result = subprocess.run([tree / "stack", "build"], env=environment, capture_output=True, text=True, timeout=120)
    assert not (tmp_path / "installed" / "aiohttp.py").exists()
    assert result.returncode != 0 and "DO NOT MATCH THE HASHES" in result.stderr
    assert "nothing was installed: a package is not the one of requirements/stack.txt" in result.stderr
    assert not (tree / ".venv" / "installed").exists()
