"""The unit for systemd: it says what systemd itself accepts, and starts what the person wanted."""

import shutil
import subprocess

import pytest

from telepresence.station import service
from telepresence.station.heartbeat import PERIOD


def test_systemd_accepts_it(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # where no user is logged in there is none
    path = tmp_path / "telepresence.service"
    path.write_text(service.unit(["pepper", "gui:=false"]))
    if shutil.which("systemd-analyze") is None:  # a machine without systemd: what it would complain about is not known
        assert path.read_text().count("\n[") == 2
        return
    result = subprocess.run(["systemd-analyze", "--user", "verify", str(path)], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.parametrize(
    ("argument", "word"),
    [
        ("source:=100%", '"source:=100%%"'),
        ("source:=$HOME", '"source:=$$HOME"'),
        ('source:=a "b"\\', '"source:=a \\"b\\"\\\\"'),
    ],
)
def test_what_systemd_would_expand_is_kept(argument, word):
    assert word in service.unit(["pepper", argument])


def test_it_is_watched_for_longer_than_a_beat_takes():
    assert service.WATCHDOG_PERIOD > 10 * PERIOD
    assert "WatchdogSec=2\n" in service.unit(["pepper"])
