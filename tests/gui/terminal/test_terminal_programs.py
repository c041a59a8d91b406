"""Whether a shell that is gone was left or killed, on a made-up process table."""

from __future__ import annotations

import pytest

from gui.terminal import terminal_programs
from gui.terminal.terminal_programs import TerminalPrograms

SERVER, SHELL, JOB = 10, 20, 30


@pytest.fixture
def table(monkeypatch):
    """Shell -> its job in the foreground; the process ids of what runs."""
    table = {"shells": {SHELL: JOB}, "alive": {SHELL, JOB}}
    monkeypatch.setattr(terminal_programs, "children", lambda pid: list(table["shells"]) if pid == SERVER else [])
    monkeypatch.setattr(terminal_programs.vitals, "foreground", lambda pid: table["shells"].get(pid, -1))
    monkeypatch.setattr(terminal_programs.vitals, "start_time", lambda pid: 7 if pid in table["alive"] else 0)
    monkeypatch.setattr(terminal_programs.vitals, "state", lambda pid: "S")
    return table


@pytest.mark.parametrize("reaped", [False, True], ids=["a look before tmux has noticed", "a look after it"])
def test_a_shell_that_waited_for_a_program_was_killed_whenever_somebody_looks(table, reaped):
    programs = TerminalPrograms()
    programs.poll(SERVER)
    table["alive"].remove(SHELL)
    table["shells"] = {} if reaped else {SHELL: SHELL}
    programs.poll(SERVER)
    assert programs.running
    table["alive"].remove(JOB)
    assert not programs.running, "the hang-up has ended it"


def test_a_shell_at_its_prompt_was_left(table):
    programs = TerminalPrograms()
    programs.poll(SERVER)
    table["shells"] = {SHELL: SHELL}
    programs.poll(SERVER)
    table["shells"] = {}
    programs.poll(SERVER)
    assert not programs.running
