"""Whatever the window's terminal consists of may die or be stopped: the window says so and opens another one."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from window_input import Window, _command

from gui.terminal.terminal_parts import listener
from telepresence.station import processes, vitals

DIED, FROZE = "The terminal of this window died; it opens again", "The terminal of this window froze; it opens again"
REAPER_SENTENCE = "What ends the terminal together with this window {}; it starts again."


@pytest.fixture
def window(screen) -> Window:
    return screen.open_window("--tell")


def part(window: Window, name: str) -> int:
    """The process id of a part of the window's terminal; 0 when it is not there."""
    if name == "server":
        return listener(window.tmux.socket)
    xterm = next((pid for pid in processes.descendants(window.process.pid) if command(pid) == "xterm"), 0)
    if name == "xterm":
        return xterm
    if name == "reaper":
        return next(pid for pid in processes.descendants(window.process.pid) if "tmux-reaper" in _command(pid))
    wanted = {"between": "sh", "client": "tmux: client"}[name]
    return next((pid for pid in processes.descendants(xterm) if command(pid) == wanted), 0)


def command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/comm").read_text().strip()
    except OSError:
        return ""


@pytest.mark.parametrize("name", ["xterm", "between", "client", "server"])
def test_another_terminal_takes_the_place_of_one_that_fails(window, wait_until, name):
    for end, sentence in ((signal.SIGKILL, DIED), (signal.SIGSTOP, FROZE)):
        before = part(window, "xterm"), part(window, "server")
        os.kill(part(window, name), end)
        wait_until(lambda sentence=sentence: sentence in window.output, f"told: {sentence}")
        wait_until(
            lambda before=before: part(window, "server") not in (0, before[1]) and "$" in window.terminal_text(),
            "another terminal has a prompt",
        )
        assert part(window, "xterm") != before[0]
        wait_until(lambda before=before: not any(map(lives, before)), "of the one before nothing is left")
    assert "unwatched" not in window.output


def test_what_ends_the_terminal_is_replaced(window, wait_until):
    for end, befallen in ((signal.SIGKILL, "died (signal 9)"), (signal.SIGSTOP, "froze")):
        before = part(window, "reaper")
        os.kill(before, end)
        wait_until(lambda befallen=befallen: REAPER_SENTENCE.format(befallen) in window.output, "told")
        assert part(window, "reaper") != before
    server = part(window, "server")
    window.process.kill()
    wait_until(lambda: not lives(server), "the terminal ends with the window")
    wait_until(lambda: not window.tmux.socket.exists(), "nor is its socket left")


def test_a_terminal_that_a_person_leaves_stays_closed(window, wait_until):
    window.enter_terminal()
    window.screen.do("type", "exit\n")
    wait_until(lambda: not window.terminal_text() and listener(window.tmux.socket) == 0, "the terminal is closed")
    assert "opens again" not in window.output


def lives(pid: int) -> bool:
    return vitals.start_time(pid) != 0
