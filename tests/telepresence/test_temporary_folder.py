"""A temporary folder goes with its owner, and that of a killed owner with the next of its kind."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from telepresence.temporary_folder import TemporaryFolder, ownerless

KIND = "kind-of-test-"
OWNER = f"""
import signal
from telepresence.temporary_folder import TemporaryFolder
folder = TemporaryFolder({KIND!r})
(folder.path / "file").touch()
print(folder.path, flush=True)
signal.pause()
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


@pytest.fixture
def start():
    """Start owners of folders in processes of their own; they are killed at the end."""
    owners = []

    def start() -> tuple[subprocess.Popen, Path]:
        owners.append(subprocess.Popen([sys.executable, "-c", OWNER], stdout=subprocess.PIPE, text=True))
        return owners[-1], Path(owners[-1].stdout.readline().strip())

    yield start
    for owner in owners:
        owner.kill()
        owner.wait()
        owner.stdout.close()


def test_the_next_one_removes_those_of_killed_owners_alone(start):
    killed, gone = start()
    living, kept = start()
    killed.kill()
    killed.wait()
    assert gone.exists(), "nobody removes what it cannot know of"
    with TemporaryFolder(KIND) as ours:
        assert not gone.exists() and ours.exists()
        assert (kept / "file").exists(), "its owner lives"
        assert ownerless(KIND) == []
    assert living.poll() is None


def test_it_is_private_and_gone_at_the_end():
    folder = TemporaryFolder(KIND)
    assert folder.path.stat().st_mode & 0o777 == 0o700
    (folder.path / "below").mkdir()
    folder.close()
    assert not folder.path.exists()
    folder.close()  # harmless


def test_other_kinds_links_and_files_stay(temporary):
    (temporary / "precious").mkdir()
    (temporary / f"{KIND}link").symlink_to(temporary / "precious")
    (temporary / f"{KIND}file").touch()
    (temporary / "another-kind").mkdir()
    TemporaryFolder(KIND).close()
    assert sorted(path.name for path in temporary.iterdir()) == [
        "another-kind", f"{KIND}file", f"{KIND}link", "precious",
    ]  # fmt: skip


def test_another_users_folder_stays(temporary, monkeypatch):
    (temporary / f"{KIND}left").mkdir()
    assert ownerless(KIND) == [temporary / f"{KIND}left"]
    user = os.geteuid()
    monkeypatch.setattr("os.geteuid", lambda: user + 1)
    assert ownerless(KIND) == []


def test_what_it_has_elsewhere_goes_before_it(temporary):
    (temporary / f"{KIND}left").mkdir()
    (temporary / f"{KIND}left" / "where").write_text("elsewhere")
    (temporary / "elsewhere").touch()

    def remove_elsewhere(folder: Path) -> None:
        for note in folder.glob("where"):
            (temporary / note.read_text()).unlink()

    TemporaryFolder(KIND, remove_elsewhere).close()
    assert [*temporary.iterdir()] == []
