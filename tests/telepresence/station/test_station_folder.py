"""What a killed station leaves is found and ended by the next start, and nothing else is."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from waiting import wait_until

from telepresence import temporary_folder
from telepresence.station import processes, station_folder, virtual_display
from telepresence.station.station_folder import StationFolder

STATION = """
import signal, subprocess, sys, tempfile
from telepresence.station import station_folder
station_folder.VARIABLE = sys.argv[1]
folder = station_folder.StationFolder()
tempfile.mkdtemp(prefix="pepper-disk-")
child = subprocess.Popen(["sleep", "60"], start_new_session=True)
print(child.pid, folder.path, flush=True)
signal.pause()
"""
"""A station with one program and one temporary file."""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The folder for temporary files, ours alone; nobody else's tmux and programs either."""
    monkeypatch.setattr(station_folder, "VARIABLE", f"STATION_OF_TEST_{os.getpid()}")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("TMUX_TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


def start() -> tuple[subprocess.Popen, int, Path]:
    """Return a station, the process id of its program, and its folder."""
    station = subprocess.Popen(
        [sys.executable, "-c", STATION, station_folder.VARIABLE], stdout=subprocess.PIPE, text=True
    )
    child, folder = station.stdout.readline().split()
    # Popen returns before the kernel has given the program its environment.
    wait_until(lambda: station_folder.belongs(int(child), Path(folder)), "the program has begun")
    return station, int(child), Path(folder)


def test_only_what_a_killed_station_left_is_swept(temporary):
    living, kept, there = start()
    killed, orphan, gone = start()
    assert list(gone.glob("pepper-disk-*"))
    try:
        killed.kill()
        killed.wait()
        found = station_folder.sweep()
        assert found == [f"sleep (process {orphan})", str(gone)]
        assert not gone.exists() and there.exists()
        assert not Path(f"/proc/{orphan}/cmdline").exists() or not Path(f"/proc/{orphan}/cmdline").read_bytes()
        assert processes.send(kept, 0)
        assert station_folder.sweep() == [], "the second time nothing is left"
    finally:
        living.kill()
        living.wait()
        assert station_folder.sweep()
        for station in (living, killed):
            station.stdout.close()


def test_programs_whose_folder_somebody_removed_are_ended_too(temporary):
    station, orphan, folder = start()
    station.kill()
    station.wait()
    station.stdout.close()
    temporary_folder.remove(folder)
    assert station_folder.sweep() == [f"sleep (process {orphan})"]


def test_an_end_removes_the_folder_and_what_it_set(temporary, monkeypatch):
    monkeypatch.delenv(station_folder.VARIABLE, raising=False)
    folder = StationFolder()
    assert os.environ["TMPDIR"] == os.environ[station_folder.VARIABLE] == str(folder.path)
    assert folder.path.stat().st_mode & 0o777 == 0o700
    folder.close()
    assert not folder.path.exists()
    assert os.environ["TMPDIR"] == str(temporary) and station_folder.VARIABLE not in os.environ


def test_a_killed_x_server_leaves_no_lock(temporary, monkeypatch):
    monkeypatch.setattr(virtual_display, "_X_LOCK", f"{temporary}/.X{{}}-lock")
    monkeypatch.setattr(virtual_display, "_X_SOCKET", f"{temporary}/X{{}}")
    ended = subprocess.Popen(["true"])
    ended.wait()
    for number, pid in (("7", ended.pid), ("8", os.getpid())):
        display = temporary / f"{station_folder.PREFIX}x{number}" / f"{virtual_display.PREFIX}1"
        display.mkdir(parents=True)
        (display / virtual_display.NUMBER).write_text(number)
        (temporary / f".X{number}-lock").write_text(f"{pid:>10}\n")
        (temporary / f"X{number}").touch()
    assert len(station_folder.sweep()) == 2
    assert sorted(path.name for path in temporary.iterdir()) == [".X8-lock", "X8"], "8 is a living server's"


def test_another_users_link_is_left_alone(temporary):
    (temporary / "precious").mkdir()
    (temporary / f"{station_folder.PREFIX}link").symlink_to(temporary / "precious")
    assert station_folder.sweep() == []
    assert (temporary / "precious").is_dir()


def test_a_program_that_ignores_the_request_is_killed(temporary, monkeypatch):
    monkeypatch.setattr(station_folder, "PATIENCE", 0.1)
    stubborn = (
        "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('ready', flush=True); signal.pause()"
    )
    environment = {**os.environ, station_folder.VARIABLE: str(temporary / "gone")}
    program = subprocess.Popen([sys.executable, "-c", stubborn], env=environment, stdout=subprocess.PIPE, text=True)
    assert program.stdout.readline() == "ready\n"
    station_folder.sweep()
    assert program.wait() == -signal.SIGKILL
    program.stdout.close()


@pytest.mark.parametrize("whose", ["ours", "somebody else's"])
def test_only_our_own_terminals_are_swept(temporary, monkeypatch, whose):
    """The folder's name is known, and /tmp is everybody's: whoever makes it first must not keep us from starting."""
    folder = temporary / f"tmux-{os.getuid()}"
    folder.mkdir()
    terminal = folder / "telepresence-1"
    terminal.touch()
    if whose != "ours":
        told = Path.lstat
        monkeypatch.setattr(Path, "lstat", lambda path: SimpleNamespace(st_uid=65534) if path == folder else told(path))
    assert station_folder.sweep() == ([str(terminal)] if whose == "ours" else [])
    assert terminal.exists() == (whose != "ours")
