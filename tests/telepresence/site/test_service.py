"""The unit for systemd: it says what systemd itself accepts, and starts what the person wanted."""

import shutil
import subprocess
from pathlib import Path

import pytest

from telepresence.site import service
from telepresence.station.absence import VARIABLE
from telepresence.station.heartbeat import PERIOD

SITE = Path(__file__).resolve().parents[3] / "docs" / "site.toml"


@pytest.mark.parametrize(
    "words",
    [
        (["pepper", "gui:=false"],),
        (["robotino", "source:=a\\"], "unit"),
        (["/a b/site.toml"], "site up", 20.0, service.SITE_ENDING),
    ],
)
def test_systemd_accepts_it(tmp_path, monkeypatch, words):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # where no user is logged in there is none
    path = tmp_path / "telepresence.service"
    path.write_text(service.unit(*words))
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


@pytest.mark.parametrize("words", [["pepper", "source:=a\nExecStartPre=/bin/false"], ["site", "{site}"]])
def test_what_would_be_another_line_of_the_unit_is_refused(monkeypatch, capsys, tmp_path, words):
    site = tmp_path / "a\nb.toml"
    site.write_text("[robot.anna]\n")
    monkeypatch.setattr("sys.argv", ["service", *(word.format(site=site) for word in words)])
    assert service.main() == 1
    printed = capsys.readouterr()
    assert printed.out == "" and "a unit takes no line breaks" in printed.err


def test_a_word_that_ends_in_a_backslash_swallows_no_line():
    (title,) = (
        line for line in service.unit(["pepper", "source:=a\\"]).splitlines() if line.startswith("Description=")
    )
    assert title.endswith("source:=a\\\\")


def test_it_is_watched_for_longer_than_a_beat_takes():
    assert service.WATCHDOG_PERIOD > 10 * PERIOD
    assert "WatchdogSec=2\n" in service.unit(["pepper"])


@pytest.mark.parametrize(
    ("words", "goes_on"), [(["pepper"], True), (["unit", "robotino"], True), (["site", str(SITE)], False)]
)
def test_a_station_outlives_its_stack_up_and_a_site_does_not(monkeypatch, capsys, words, goes_on):
    monkeypatch.setattr("sys.argv", ["service", *words])
    service.main()
    printed = capsys.readouterr().out
    assert (f"Environment={VARIABLE}=1\nKillMode=process\n" in printed) is goes_on
    assert ("KillMode=control-group\n" in printed) is not goes_on


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["pepper", "gui:=false"], '/stack" "up" "pepper" "gui:=false"\n'),
        (
            ["unit", "robotino", "sim:=false"],
            '/stack" "unit" "robotino" "sim:=false" "gui:=false" "teleop:=false" "conversation:=false"\n',
        ),
        (["site", str(SITE)], f'/stack" "site" "up" "{SITE}"\n'),
    ],
)
def test_it_starts_what_the_person_named(monkeypatch, capsys, words, line):
    monkeypatch.setattr("sys.argv", ["service", *words])
    assert service.main() == 0
    assert line in capsys.readouterr().out


def test_a_site_that_is_none_gets_no_unit(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("sys.argv", ["service", "site", str(tmp_path / "none.toml")])
    assert service.main() == 1
    assert "No such file" in capsys.readouterr().err
