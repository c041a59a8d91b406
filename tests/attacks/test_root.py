"""Root starts the station: whoever gets at the window's terminal must not be root by it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "stack").exists())
PRIVATE = """
set -e
mount --bind {etc} /etc
mount --bind {var} /var/lib
useradd --create-home --home-dir /var/lib/anna --shell /bin/bash anna
{command}
"""
REPORT = 'echo "$(id -un) $(stat -c %U $HOME) ${SUDO_UID:-}"; touch $HOME/here 2>&1; env'


def run(folder: Path, command: str, **environment: str) -> subprocess.CompletedProcess:
    """Run a shell command; for root with users of its own, in a mount namespace that goes with it."""
    told = {name: value for name, value in os.environ.items() if name != "TELEPRESENCE_AS_ROOT"}
    words = ["sh", "-c", command]
    if os.geteuid() == 0:
        (folder / "var").mkdir()
        subprocess.run(["cp", "-a", "/etc", folder / "etc"], check=True)
        script = PRIVATE.format(etc=folder / "etc", var=folder / "var", command=command)
        words = ["unshare", "--mount", "sh", "-c", script]
    return subprocess.run(words, env={**told, **environment}, cwd=ROOT, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("caller", ["sudo", "root"])
def test_a_command_of_the_station_is_root(tmp_path, caller):
    """With sudo it is the person who called it; where everything is root's, a user of its own, or nobody at all."""
    program = f"{sys.executable} -m telepresence.station.unprivileged sh -c '{REPORT}'"
    before = "export SUDO_UID=$(id -u anna); " if caller == "sudo" and os.geteuid() == 0 else ""
    done = run(tmp_path, before + program, XDG_CONFIG_HOME="/root")
    if done.returncode:  # nobody else can read this checkout
        assert "TELEPRESENCE_AS_ROOT=1" in done.stderr and not done.stdout
        return
    name, owner, *sudo = done.stdout.splitlines()[0].split()
    assert name != "root" and owner == name and not sudo
    if os.geteuid() == 0:
        checkout = ROOT.owner()
        assert name == ("anna" if caller == "sudo" else checkout if checkout != "root" else "telepresence")
        assert f"as {name}" in done.stderr and "XDG_CONFIG_HOME" not in done.stdout and "cannot" not in done.stdout


def test_the_station_is_started_as_root_without_the_command(tmp_path):
    """Past ./stack: it says no, and what to do."""
    done = run(tmp_path, f"{sys.executable} -m telepresence.station pepper nonsense:=1")
    assert done.returncode == 1
    assert ("./stack up" if os.geteuid() == 0 else "nonsense") in done.stderr


def test_accounts_that_root_makes_are_those_of_the_station(tmp_path):
    """No attack: whom root lets in gets in, though the station is not root's."""
    environment, before = {"HOME": "/root", "SUDO_UID": ""}, ""
    if os.geteuid() != 0:
        environment = {"TELEPRESENCE_USERS": str(tmp_path / "users.db")}
    elif ROOT.owner() != "root":  # whose accounts are in the checkout, and not for tests
        before = f"install -d -m 700 -o {ROOT.owner()} /var/lib/accounts; "
        environment["TELEPRESENCE_USERS"] = "/var/lib/accounts/users.db"
    users = f"{sys.executable} -m gui.users"
    add = f"echo a long password | {users} add anna --role pilot --password-stdin"
    station = f"{sys.executable} -m telepresence.station.unprivileged {users} list"
    done = run(tmp_path, f"{before}{add}; {station}", **environment)
    if "nobody else can run it" in done.stderr:
        assert "TELEPRESENCE_AS_ROOT=1" in done.stderr and not done.stdout
    else:
        assert done.stdout.split()[:2] == ["anna", "pilot"], done.stderr


def test_root_stays_root_where_it_is_told_to(tmp_path):
    """No attack: for those who know what they do."""
    program = f"{sys.executable} -m telepresence.station.unprivileged id -u"
    assert run(tmp_path, program, TELEPRESENCE_AS_ROOT="1").stdout.strip() == str(os.geteuid())


@pytest.mark.parametrize("words", ["pair --list", "up --help", "service --help"])
def test_a_folder_that_somebody_else_has_filled_is_where_root_types_a_command(tmp_path, words):
    """Python takes a package from the current folder before all others, and /tmp is everybody's."""
    package = tmp_path / "telepresence"
    for name in ("station/unprivileged.py", "station/pair.py", "station/__main__.py", "site/service.py"):
        for folder in (package, (package / name).parent):
            folder.mkdir(exist_ok=True)
            (folder / "__init__.py").touch()
        (package / name).write_text("print('INTRUDER')\n")
    done = subprocess.run(
        [str(ROOT / "stack"), *words.split()],
        cwd=tmp_path,
        env={**os.environ, "TELEPRESENCE_AS_ROOT": "1", "XDG_CONFIG_HOME": str(tmp_path)},
        text=True,
        capture_output=True,
        timeout=120,
    )
    assert "INTRUDER" not in done.stdout + done.stderr
    assert done.returncode == 0 or words == "pair --list", done.stderr
