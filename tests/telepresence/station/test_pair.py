"""`./stack pair` as it is typed."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from telepresence.security.robot_key import RobotKey, path_of
from telepresence.station.pair import main

ROOT = Path(__file__).resolve().parents[3]
KEY = RobotKey(bytes(range(32)))


@pytest.fixture(autouse=True)
def store(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


def pair(*words: str, typed: str = "") -> subprocess.CompletedProcess:
    return subprocess.run(
        [str(ROOT / "stack"), "pair", *words], input=typed, capture_output=True, text=True, timeout=60, env=os.environ
    )


def test_a_key_is_paired_listed_replaced_and_forgotten():
    done = pair("192.168.0.1", typed=f"{KEY.text}\n")
    assert (done.returncode, done.stderr) == (0, "") and KEY.fingerprint in done.stdout
    assert KEY.text not in done.stdout, "a key is shown once, when it is made"
    assert RobotKey.of("192.168.0.1") == KEY
    assert main(["192.168.0.1", "--file", str(path_of("192.168.0.1"))]) == 0
    listed = pair("--list").stdout
    assert listed.split() == ["192.168.0.1", KEY.fingerprint]
    assert main(["--forget", "192.168.0.1"]) == 0
    assert RobotKey.of("192.168.0.1") is None
    assert "no robot's key" in pair("--list").stdout


def test_a_file_of_the_bundle_is_taken(tmp_path, capsys):
    key, other = RobotKey.make(tmp_path / "robot.key"), RobotKey.make(tmp_path / "other.key")
    assert main(["robot", "--file", str(tmp_path / "other.key")]) == 0
    assert main(["robot", "--file", str(tmp_path / "robot.key")]) == 0
    said = capsys.readouterr().out
    assert f"{key.fingerprint} in place of {other.fingerprint}" in said
    assert RobotKey.of("robot") == key


@pytest.mark.parametrize("typed", ["", "1234", "x" * 64, KEY.text + "00", "0" * 100_000])
def test_what_is_no_key_is_refused_and_not_repeated(typed):
    done = pair("192.168.0.1", typed=typed)
    assert done.returncode == 1 and "64 hexadecimal digits" in done.stderr
    assert len(done.stderr) < 200 and "Traceback" not in done.stderr
    assert RobotKey.of("192.168.0.1") is None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "which robot?"),
        (["--list", "robot"], "--list takes no address"),
        (["../robot"], "not the address of a robot"),
        (["--forget", "robot"], "./stack pair --list"),
        (["robot", "--file", "/nowhere/robot.key"], "there is no key at /nowhere/robot.key"),
    ],
)
def test_mistakes_are_explained(words, said, capsys):
    try:
        status = main(words)
    except SystemExit as error:
        status = error.code
    assert status in (1, 2) and said in capsys.readouterr().err


def test_a_key_file_that_others_can_read_is_not_taken(tmp_path, capsys):
    RobotKey.make(tmp_path / "robot.key")
    (tmp_path / "robot.key").chmod(0o644)
    assert main(["robot", "--file", str(tmp_path / "robot.key")]) == 1
    assert "chmod 600" in capsys.readouterr().err


PRIVATE = """
set -e
mount --bind {folder}/etc /etc
mount --bind {folder}/var /var/lib
useradd --create-home --home-dir /var/lib/anna --shell /bin/bash anna
export SUDO_UID=$(id -u anna) PYTHONPATH={root}
echo {key} >/var/lib/robot.key
chmod 600 /var/lib/robot.key
chown {owner} /var/lib/robot.key
pair() {{ /usr/bin/python3 -m telepresence.station.pair "$@"; }}
pair 10.0.0.7 --file /var/lib/robot.key
echo {key} | pair 10.0.0.8
stat -c '%U %a %n' /var/lib/anna/.config/telepresence/keys/*
pair --forget 10.0.0.7
pair --list
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes somebody else")
@pytest.mark.parametrize("owner", ["root", "anna"])
def test_a_key_that_root_brings_is_that_of_the_station(tmp_path, owner):
    """It is stored where the station's user looks for it, by an interpreter that has nothing but its own library."""
    (tmp_path / "var").mkdir()
    subprocess.run(["cp", "-a", "/etc", tmp_path / "etc"], check=True)
    script = PRIVATE.format(folder=tmp_path, root=ROOT, key=KEY.text, owner=owner)
    environment = {name: value for name, value in os.environ.items() if name != "TELEPRESENCE_AS_ROOT"}
    done = subprocess.run(
        ["unshare", "--mount", "sh", "-c", script], env=environment, capture_output=True, text=True, timeout=60
    )
    if "nobody else can run it" in done.stderr:
        pytest.skip("nobody but root can read this checkout")
    assert done.returncode == 0 and "Not as root but as anna" in done.stderr, done.stderr
    store = "/var/lib/anna/.config/telepresence/keys"
    kept = [line for line in done.stdout.splitlines() if line.startswith("anna")]
    assert kept == [f"anna 600 {store}/10.0.0.7.key", f"anna 600 {store}/10.0.0.8.key"]
    assert done.stdout.splitlines()[-1].split() == ["10.0.0.8", KEY.fingerprint]
    assert not (tmp_path / "config").exists(), "root's own store"
