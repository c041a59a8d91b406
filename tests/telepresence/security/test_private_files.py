"""Files and folders that only their owner reads."""

from __future__ import annotations

import os
import stat

import pytest

from telepresence.security import private_files
from telepresence.security.private_files import NotPrivate


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def loose(path, text="x"):
    path.write_text(text)
    path.chmod(0o644)
    return path


def test_a_folder_is_made_for_its_owner_only(tmp_path, capsys):
    assert mode(private_files.make_folder(tmp_path / "deep" / "down")) == 0o700
    assert capsys.readouterr().err == ""


def test_an_open_folder_is_closed_and_said_once(tmp_path, capsys):
    (tmp_path / "open").mkdir(0o755)
    for _ in range(2):
        assert mode(private_files.make_folder(tmp_path / "open")) == 0o700
    assert capsys.readouterr().err.count("\n") == 1


def test_a_home_directory_keeps_its_mode(tmp_path, monkeypatch):
    tmp_path.chmod(0o755)
    monkeypatch.setenv("HOME", str(tmp_path))
    private_files.make_folder(tmp_path)
    assert mode(tmp_path) == 0o755


def test_what_is_no_folder_of_ours_is_refused(tmp_path):
    (tmp_path / "all").mkdir()
    (tmp_path / "all").chmod(0o1777)
    with pytest.raises(NotPrivate, match="everybody"):
        private_files.make_folder(tmp_path / "all")
    (tmp_path / "link").symlink_to(tmp_path)
    with pytest.raises(NotPrivate, match="symbolic link"):
        private_files.make_folder(tmp_path / "link")
    with pytest.raises(OSError):
        private_files.make_folder(loose(tmp_path / "file"))
    assert mode(tmp_path / "all") == 0o1777


def test_a_readable_file_is_tightened_and_said(tmp_path, capsys):
    path = loose(tmp_path / "file")
    assert private_files.read(path) == b"x" and mode(path) == 0o600
    assert private_files.read(path) == b"x"
    assert capsys.readouterr().err.count("\n") == 1


def test_links_and_pipes_are_refused_and_not_emptied(tmp_path):
    victim = loose(tmp_path / "victim")
    (tmp_path / "soft").symlink_to(victim)
    (tmp_path / "dangling").symlink_to(tmp_path / "nothing")
    (tmp_path / "hard").hardlink_to(victim)
    os.mkfifo(tmp_path / "pipe", 0o600)
    for name in ("soft", "dangling", "hard", "pipe"):
        with pytest.raises(OSError):
            private_files.open_file(tmp_path / name, os.O_RDWR | os.O_CREAT | os.O_TRUNC)
    assert victim.read_text() == "x" and mode(victim) == 0o644 and not (tmp_path / "nothing").exists()


def test_somebody_elses_file_is_refused(tmp_path, monkeypatch):
    path = loose(tmp_path / "file")
    other = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: other)
    for refused in (private_files.read, lambda path: private_files.make_folder(path.parent)):
        with pytest.raises(NotPrivate, match="belongs to"):
            refused(path)


def test_a_file_is_written_at_once_and_in_place_of_a_link(tmp_path):
    victim = loose(tmp_path / "victim")
    path = tmp_path / "file"
    path.symlink_to(victim)
    private_files.write(path, b"new")
    assert path.read_bytes() == b"new" and mode(path) == 0o600 and not path.is_symlink()
    assert victim.read_text() == "x"
    with pytest.raises(OSError):
        private_files.write(tmp_path / "no folder" / "file", b"")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "victim"]


def test_only_what_must_outlive_a_loss_of_power_waits_for_the_disk(tmp_path, monkeypatch):
    waited = []
    monkeypatch.setattr(os, "fsync", waited.append)
    private_files.write(tmp_path / "picture", b"new")
    assert waited == []
    private_files.write(tmp_path / "key", b"new", lasting=True)
    assert len(waited) == 1


def test_only_own_files_with_the_endings_are_tightened(tmp_path, capsys):
    files = [loose(tmp_path / name) for name in ("a.bag", "b.png", "c.txt")]
    (tmp_path / "d.bag").symlink_to(files[2])
    assert private_files.tighten(tmp_path, ".bag", ".png") == 2
    assert [mode(file) for file in files] == [0o600, 0o600, 0o644]
    assert private_files.tighten(tmp_path, ".bag", ".png") == 0
    assert capsys.readouterr().err.count("\n") == 1
    assert private_files.tighten(tmp_path / "nothing", ".bag") == 0
