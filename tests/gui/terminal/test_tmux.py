"""A tmux server of our own. Its client runs in a terminal of the test's."""

import fcntl
import os
import pty
import subprocess
import termios
import threading
from pathlib import Path

import pytest

from gui.terminal import tmux as tmux_module
from gui.terminal.tmux import Tmux, TmuxError, environment
from telepresence.station import processes


@pytest.fixture
def tmux(wait_until):
    server = Tmux(f"telepresence-test-{os.getpid()}")
    reaper = server.start_reaper()
    master, slave = pty.openpty()
    termios.tcsetwinsize(slave, (24, 80))
    client = subprocess.Popen(
        server.attach_command,
        stdin=slave,
        stdout=slave,
        stderr=slave,
        env=environment() | {"TERM": "xterm"},
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )
    os.close(slave)
    threading.Thread(target=_drain, args=[master], daemon=True).start()
    yield server
    reaper.stdin.close()
    reaper.wait(10)
    processes.end(client)
    wait_until(lambda: not server._has_session(), "the server has ended")


def _drain(master):
    try:
        while os.read(master, 4096):
            pass
    except OSError:
        os.close(master)


def end_program(tmux, patience=30.0):
    return tmux.end_program("session", patience, given_up=lambda: False)


def test_a_line_is_typed_at_the_prompt(tmux, wait_until):
    tmux.type_line("session", "echo $((6 * 7))")
    wait_until(lambda: "\n42\n" in tmux.text("session"), "the shell has run the line")


def test_the_report_s_line_types_into_it_from_within(tmux, wait_until):
    """In the window's terminal, tmux knows which server it talks to."""
    tmux.type_line("session", "tmux send-keys -t my_session:0 'echo $((6 * 9))' Enter")
    wait_until(lambda: "\n54\n" in tmux.text("session"), "the shell has run the line")


def test_a_program_is_told_from_the_prompt(tmux, wait_until):
    assert tmux.program("roscore") == "", "there is no such window"
    tmux.type_line("session", "sleep 100")
    wait_until(lambda: tmux.program("session") == "sleep", "sleep runs")
    assert end_program(tmux) == ""
    assert tmux.program("session") == "", "the shell is at its prompt"


def test_a_program_that_loses_the_first_ctrl_c_gets_another(tmux, wait_until, monkeypatch, tmp_path):
    """roslaunch does, when it comes while `rosmaster` is imported."""
    monkeypatch.setattr(tmux_module, "INTERRUPT_PERIOD", 0.3)
    program = tmp_path / "starting.py"
    wait = "time.sleep(100)"
    program.write_text(
        f"import time\ntry:\n    print('up', flush=True)\n    {wait}\nexcept KeyboardInterrupt:\n    {wait}\n"
    )
    tmux.type_line("session", f"python3 {program}")
    wait_until(lambda: "\nup" in tmux.text("session"), "the program runs")
    assert end_program(tmux) == ""


def test_a_program_that_cannot_be_interrupted_is_named(tmux, wait_until):
    tmux.type_line("session", "(trap '' INT; exec sleep 100)")
    wait_until(lambda: tmux.program("session") == "sleep", "sleep runs")
    assert end_program(tmux, patience=0.5) == "sleep"


def test_another_window_is_opened_for_another_program(tmux, wait_until):
    tmux.type_line("roscore", "echo there")
    wait_until(lambda: "\nthere" in tmux.text("roscore"), "the shell has run the line")
    assert tmux.windows() == ["session", "roscore"]


def test_nothing_is_typed_into_a_running_program(tmux, wait_until):
    tmux.type_line("session", "cat")
    with pytest.raises(TmuxError, match="cat runs in the terminal's window 'session'"):
        tmux.type_line("session", "echo lost")
    end_program(tmux)
    tmux.type_line("session", "echo found")
    wait_until(lambda: "\nfound" in tmux.text("session"), "the shell has run the line")
    assert "lost" not in tmux.text("session")


def test_characters_of_the_shell_and_of_tmux_arrive_as_they_are(tmux, wait_until):
    tmux.type_line("session", "echo 'a;b' \"C-c Enter\" $((1)) ;")
    wait_until(lambda: "\na;b C-c Enter 1\n" in tmux.text("session"), "the shell has run the line")
    assert "$((1)) ;\n" in tmux.text("session")


def test_a_tmux_around_us_does_not_matter(monkeypatch):
    monkeypatch.setenv("TMUX", "/tmp/elsewhere,1,0")
    assert "TMUX" not in environment()


def test_interrupting_where_nothing_runs_is_no_error():
    assert end_program(Tmux("telepresence-test-nobody")) == ""


def test_a_closed_terminal_is_named(monkeypatch):
    monkeypatch.setattr("gui.terminal.tmux.TIMEOUT", 0.1)
    with pytest.raises(TmuxError):
        Tmux("telepresence-test-nobody").windows()


def test_the_shell_finds_the_project_by_itself():
    bashrc = Path(tmux_module.__file__).with_name("terminal.bashrc")
    words = ["bash", "--noprofile", "--rcfile", str(bashrc), "-i", "-c", "echo $ROS_PACKAGE_PATH"]
    shell = subprocess.run(
        words,
        env={"PATH": os.defpath, "HOME": "/"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=30,
    )
    assert "catkin_ws" in shell.stdout, shell.stderr
