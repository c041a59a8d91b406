"""What programs print goes to a file, and never makes them wait or fail."""

import os
import subprocess
import sys

import pytest

from telepresence.station import program_output
from telepresence.station.log_folder import OUTPUTS, cut_outputs
from telepresence.station.plan import Plan
from telepresence.station.program_output import ProgramOutput
from telepresence.station.terminal_printer import TerminalPrinter
from telepresence.station.up import Terminal


@pytest.fixture
def output(tmp_path):
    output = ProgramOutput(tmp_path / "log" / f"up{OUTPUTS[0]}")
    yield output
    output.close()


@pytest.fixture
def errors(tmp_path):
    errors = ProgramOutput(tmp_path / "log" / f"up{OUTPUTS[1]}")
    yield errors
    errors.close()


def plan(window: bool, verbose: bool = False) -> Plan:
    return Plan("pepper", {}, True, window, None, "http://127.0.0.1:11311", verbose, ["pepper"])


def say(output: ProgramOutput, text: str) -> None:
    subprocess.run([sys.executable, "-S", "-c", f"print({text!r}, end='')"], stdout=output.descriptor, check=True)


def test_lines_come_when_they_are_complete_and_all_of_it_is_kept(output):
    say(output, "one\ntw")
    assert output.lines() == ["one"]
    say(output, "o\nthree\n")
    assert output.lines() == ["two", "three"]
    assert output.path.read_text() == "one\ntwo\nthree\n"
    assert output.path.stat().st_mode & 0o777 == 0o600


def test_memory_is_given_back(output, monkeypatch):
    monkeypatch.setattr(program_output, "MOST_KEPT", 4)
    for _ in range(3):
        say(output, "a line\n")
        assert output.lines() == ["a line"]
        assert os.fstat(output.descriptor).st_size == 0
    assert output.path.read_text() == "a line\n" * 3


def test_a_file_that_cannot_be_written_is_said_once_and_stops_nobody(tmp_path, caplog):
    (tmp_path / "file").write_text("")
    output = ProgramOutput(tmp_path / "file" / "up.log")
    say(output, "one\n")
    assert output.lines() == ["one"]
    output.close()
    assert len(caplog.records) == 1 and "not kept" in caplog.text


def test_the_file_is_cut_like_those_of_the_nodes(output, monkeypatch):
    monkeypatch.setattr("telepresence.station.log_folder.LARGEST_OUTPUT", 4096)
    monkeypatch.setattr("telepresence.station.log_folder.KEPT_OUTPUT", 1000)
    say(output, "0123456789\n" * 2000)
    output.lines()
    cut_outputs(output.path.parent)
    say(output, "more\n")
    output.lines()
    assert output.path.read_bytes() == b"more\n", "it goes on at the beginning"


@pytest.mark.parametrize("verbose", [False, True])
def test_the_terminal_has_errors_and_what_to_do_next_and_the_rest_on_request(output, errors, tmp_path, capfd, verbose):
    with TerminalPrinter(tmp_path) as printer:
        terminal = Terminal(output, errors, printer, plan(True, verbose), link="https://127.0.0.1:8443/#k=1")
        say(output, "[INFO] poses\nmicrophone: there is no sound card\n")
        say(errors, "[WARN] no robot\n")
        terminal.poll(started=True)
        say(output, "The window shows the first picture.\n")
        terminal.poll(started=True)
    shown, warned = capfd.readouterr()
    assert warned == "[WARN] no robot\n" and errors.path.read_text() == warned
    before, _, after = shown.partition("No sound here")
    assert (before == "[INFO] poses\nmicrophone: there is no sound card\n") == verbose
    assert after.splitlines()[-2:] == ["  https://127.0.0.1:8443/#k=1", "Ctrl-C ends all of it."]


def test_without_a_window_all_is_started_when_roslaunch_says_so(output, errors, tmp_path, capfd):
    with TerminalPrinter(tmp_path) as printer:
        terminal = Terminal(output, errors, printer, plan(window=False), link="")
        terminal.poll(started=False)
        printer.say("---")
        for _ in range(2):
            terminal.poll(started=True)
    assert capfd.readouterr().out == "---\nEverything is started. Drive from here. Ctrl-C ends all of it.\n"


def test_the_next_one_goes_on_where_the_last_one_stopped_reading(tmp_path):
    first = ProgramOutput(tmp_path / "first", tmp_path / "mark")
    say(first, "one\ntwo\nthr")
    assert first.lines() == ["one", "two"]
    say(first, "ee\nfour\n")
    left = os.open(f"/proc/self/fd/{first.descriptor}", os.O_RDWR | os.O_APPEND)
    second = ProgramOutput(tmp_path / "second", tmp_path / "mark", left)
    assert second.lines() == ["three", "four"]
    say(second, "five\n")
    assert second.lines() == ["five"]
    for output in (first, second):
        output.close()
