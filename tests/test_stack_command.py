"""The command itself, before it installs anything: help that does nothing, and machines that it refuses."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

STACK = Path(__file__).resolve().parent.parent / "stack"


def run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*words], capture_output=True, text=True, timeout=60, env={**os.environ, **environment}, cwd="/"
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("lock", "--help"), "usage: ./stack lock"),
        (("image", "--help"), "usage: ./stack image"),
        ((), "usage: ./stack"),
    ],
)
def test_help_only_helps(words, said):
    answer = run(str(STACK), *words)
    assert answer.returncode == 0 and said in answer.stdout and not answer.stderr


def test_exec_wants_a_command():
    for words in ((), ("--help",)):
        answer = run(str(STACK), "exec", *words)
        assert answer.returncode == 1 and "exec what?" in answer.stderr


@pytest.fixture
def bare_machine(tmp_path: Path) -> Path:
    """Programs of a machine without sudo, on which no Debian package is installed."""
    programs = tmp_path / "bin"
    programs.mkdir()
    for name in ("bash", "sh", "dirname", "readlink", "flock", "grep", "sed", "id", "cat", "env"):
        (programs / name).symlink_to(shutil.which(name) or "")
    (programs / "dpkg-query").write_text("#!/bin/sh\n")
    (programs / "dpkg-query").chmod(0o755)
    return programs


OTHER_SYSTEM = 'PRETTY_NAME="Ubuntu 22.04.5 LTS"\nID=ubuntu\nVERSION_CODENAME=jammy\n'


def test_another_system_is_sent_to_the_container(bare_machine, tmp_path):
    (tmp_path / "os-release").write_text(OTHER_SYSTEM)
    there = (
        f"mount --bind {tmp_path}/os-release $(readlink -f /etc/os-release) && PATH={bare_machine} exec {STACK} build"
    )
    answer = run("unshare", "--map-root-user", "--mount", "sh", "-c", there)
    assert answer.returncode == 1
    assert "this is Ubuntu 22.04.5 LTS" in answer.stderr and "./stack image" in answer.stderr


def test_a_system_without_debians_packages_is_sent_there_too(bare_machine, tmp_path):
    (bare_machine / "dpkg-query").unlink()
    (tmp_path / "os-release").write_text('PRETTY_NAME="Fedora Linux 41"\nID=fedora\n')
    there = (
        f"mount --bind {tmp_path}/os-release $(readlink -f /etc/os-release) && PATH={bare_machine} exec {STACK} build"
    )
    answer = run("unshare", "--map-root-user", "--mount", "sh", "-c", there)
    assert answer.returncode == 1 and "this is Fedora Linux 41" in answer.stderr


def test_who_may_not_install_is_told_what_an_administrator_types(bare_machine):
    (bare_machine / "id").unlink()
    (bare_machine / "id").write_text("#!/bin/sh\necho 1000\n")
    (bare_machine / "id").chmod(0o755)
    answer = run(str(STACK), "build", PATH=str(bare_machine))
    assert answer.returncode == 1, answer.stderr
    assert "neither root nor is there sudo" in answer.stderr
    assert "apt-get install --no-install-recommends" in answer.stderr and "python3-rospy" in answer.stderr
