"""A station without its `./stack up`: who notices, for how long it is waited for, and who takes it over."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from telepresence.station import absence, station_folder, takeover
from telepresence.station.absence import Absence
from telepresence.station.adopted import UNKNOWN, Adopted
from telepresence.station.station_folder import StationFolder
from telepresence.station.takeover import Left

OWNER = """
import signal
from telepresence.temporary_folder import TemporaryFolder
folder = TemporaryFolder("telepresence-station-")
print(folder.path, flush=True)
signal.pause()
"""
MASTER, ANOTHER = "http://127.0.0.1:11311", "http://127.0.0.1:11312"


@pytest.fixture
def owner(tmp_path, monkeypatch):
    """A process that owns a station's folder, and the folder."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setenv(absence.VARIABLE, "1")
    process = subprocess.Popen([sys.executable, "-c", OWNER], stdout=subprocess.PIPE, text=True)
    yield process, Path(process.stdout.readline().strip())
    process.kill()
    process.wait()


@pytest.fixture
def sleeper():
    process = subprocess.Popen(["sleep", "60"])
    yield process
    process.kill()
    process.wait()


def end(process):
    process.kill()
    process.wait()


def test_it_begins_with_the_death_of_the_owner_and_ends_with_the_next(owner, monkeypatch):
    process, folder = owner
    away = Absence(folder)
    assert not away.begins() and not away.too_long()
    end(process)
    assert away.begins() and not away.begins(), "once"
    monkeypatch.setattr(absence, "WAITS", -1.0)
    assert away.too_long()
    left = Left(str(folder), MASTER, [], {"OF_THE_STATION": "1"}, "", "", "")
    monkeypatch.setattr("os.environ", dict(os.environ))
    taken = left.take()
    try:
        assert not away.begins() and not away.too_long(), "somebody else owns it"
        assert away.owner == 0
        absence.name_owner(folder)
        assert away.owner == os.getpid()
        assert os.environ["OF_THE_STATION"] == "1" and os.environ["TMPDIR"] == str(folder)
    finally:
        taken.close()


def test_only_a_station_with_the_same_arguments_whose_programs_run_is_found(owner, sleeper, monkeypatch):
    process, folder = owner
    left = Left(str(folder), MASTER, ["pepper", "gui:=false"], {}, "https://localhost/#k=1", "", "")
    left.save()
    for name in (takeover.ROSLAUNCH, takeover.MASTER):
        takeover.note(folder, name, sleeper.pid)
    assert takeover.find(left.arguments, MASTER) is None, "its owner lives"
    end(process)
    assert takeover.find(left.arguments, MASTER) == left
    assert takeover.find(["pepper"], MASTER) is None and takeover.find(left.arguments, ANOTHER) is None
    monkeypatch.delenv(absence.VARIABLE)
    assert takeover.find(left.arguments, MASTER) is None, "nobody starts it again, so it has not gone on either"
    monkeypatch.setenv(absence.VARIABLE, "1")
    takeover.kill(folder, takeover.MASTER)
    sleeper.wait()
    assert takeover.find(left.arguments, MASTER) is None


@pytest.mark.parametrize("own", [True, False])
def test_a_new_station_ends_what_is_left_at_its_master_and_no_station_at_another_one(owner, sleeper, own):
    process, folder = owner
    Left(str(folder), MASTER if own else ANOTHER, ["robotino"], {}, "", "", "").save()
    for name in (takeover.ROSLAUNCH, takeover.MASTER):
        takeover.note(folder, name, sleeper.pid)
    end(process)
    spared = takeover.spared(None, MASTER)
    station_folder.sweep(spared)
    assert folder.exists() is not own
    StationFolder(spared=spared).close()
    assert folder.exists() is not own
    takeover.forget(folder)
    station_folder.sweep(spared)
    assert not folder.exists(), "a station that ends is nobody's"


def test_what_cannot_be_read_is_no_station(owner):
    process, folder = owner
    end(process)
    for text in (b"", b"[]", b'{"folder": 1}', b"\xff"):
        (folder / takeover.FILE).write_bytes(text)
        assert takeover.find([], MASTER) is None


def test_a_program_that_was_adopted_is_waited_for_and_ended(sleeper):
    program = Adopted(sleeper.pid)
    assert program.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        program.wait(0.01)
    program.kill()
    assert program.wait(30.0) == program.poll() == UNKNOWN
    sleeper.wait()
    program.kill()  # nothing, also for another program that has got its process id
    with pytest.raises(ProcessLookupError):
        Adopted(sleeper.pid)
