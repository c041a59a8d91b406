"""Whatever the window's terminal consists of may die or be stopped: the window says so and opens another one."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from window_input import Window, _command

from gui.terminal.terminal_parts import children, listener
from gui.terminal.terminal_view import WATCH_PERIOD
from telepresence.station import processes, vitals

DIED, FROZE = "The terminal of this window died; it opens again", "The terminal of this window froze; it opens again"
LAUNCH = """
import subprocess, sys, threading
def respawn():
    while True:
        subprocess.run([sys.executable, "-c", "import signal; signal.pause()", "__name:=keys"])
threading.Thread(target=respawn).start()
"""
"""As a plain roslaunch does, with respawn: a thread of its own starts a node again."""
OUTLIVES = "trap '' HUP; while sleep 0.1; do true; done"
"""A script that a hang-up of its terminal does not end."""
REAPER_SENTENCE = "The helper that closes this terminal {}; it starts again."


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


def known(ancestor: int, word: str) -> int:
    """The id of a descendant with this in its command line that has run for two looks of the window; 0 for none."""
    now = time.clock_gettime(time.CLOCK_BOOTTIME) * os.sysconf("SC_CLK_TCK")
    young = 2 * WATCH_PERIOD / 1000 * os.sysconf("SC_CLK_TCK")
    found = (pid for pid in processes.descendants(ancestor) if word in _command(pid))
    return next((pid for pid in found if now - vitals.start_time(pid) > young), 0)


def run_in_terminal(window: Window, script: Path, text: str, wait_until, end: str = "") -> int:
    """Start a shell script in the terminal; return its process id."""
    script.write_text(text)
    window.enter_terminal()
    window.screen.do("type", f"bash {script} {end}\n")
    server = part(window, "server")
    return wait_until(lambda: known(server, str(script)), "it runs, and the window has seen it")


def test_a_program_in_the_terminal_that_is_stopped_is_told_of_once(window, tmp_path, wait_until):
    told = "A program in the terminal froze (keyboard.sh); it stays stopped."
    program = run_in_terminal(window, tmp_path / "keyboard.sh", "read -r nothing", wait_until)
    os.kill(program, signal.SIGSTOP)
    wait_until(lambda: told in window.output, "told")
    os.kill(program, signal.SIGCONT)
    os.kill(program, signal.SIGKILL)
    wait_until(lambda: not lives(program), "it has ended")
    assert window.output.count(told) == 1 and "died" not in window.output


def test_a_node_in_the_terminal_that_is_started_again_is_told_of(window, tmp_path, wait_until):
    (tmp_path / "launch.py").write_text(LAUNCH)
    script = tmp_path / "launch.sh"
    launch = run_in_terminal(window, script, f"exec {sys.executable} {tmp_path}/launch.py {script}", wait_until)
    os.kill(wait_until(lambda: known(launch, "__name:=keys"), "the node runs"), signal.SIGTERM)
    wait_until(lambda: "A program in the terminal died (keys); it starts again." in window.output, "told")
    node = wait_until(lambda: known(launch, "__name:=keys"), "it runs again")
    os.kill(node, signal.SIGSTOP)
    wait_until(lambda: "A program in the terminal froze (keys); it stays stopped." in window.output, "told")
    for program in (launch, node):
        os.kill(program, signal.SIGKILL)
    wait_until(lambda: not lives(launch) and not lives(node), "both have ended")
    assert window.output.count("died") == 1


def test_a_shell_that_is_killed_was_not_left(window, tmp_path, wait_until):
    program = run_in_terminal(window, tmp_path / "outlives.sh", OUTLIVES, wait_until)
    (shell,) = children(part(window, "server"))
    os.kill(shell, signal.SIGKILL)
    wait_until(lambda: DIED in window.output, "told")
    wait_until(lambda: "$" in window.terminal_text(), "another terminal has a prompt")
    os.kill(program, signal.SIGKILL)


def test_a_terminal_that_a_person_leaves_stays_closed(window, tmp_path, wait_until):
    """Also with a program in the background, for which its shell does not wait."""
    program = run_in_terminal(window, tmp_path / "outlives.sh", OUTLIVES, wait_until, "&")
    window.screen.do("type", "exit\n")
    wait_until(lambda: not window.terminal_text() and listener(window.tmux.socket) == 0, "the terminal is closed")
    assert lives(program) and "opens again" not in window.output
    os.kill(program, signal.SIGKILL)


def lives(pid: int) -> bool:
    return vitals.start_time(pid) != 0
