"""The whole window on a virtual display: its terminal, its keyboard, its end. No ROS master runs."""

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from gui.__main__ import display_problem
from telepresence.station import processes
from telepresence.station.ros_master import RESTARTED

pytestmark = pytest.mark.x11

GUI_FOLDER = Path(__file__).resolve().parents[2] / "gui"


def write_file(window, path, text):
    """Type a line that leaves its trace in a file."""
    window.screen.do("type", f"echo {text} > {path}")
    window.type("Return")


def test_keys_go_where_the_last_click_was(screen, wait_until, place, tmp_path):
    """And to the terminal only after one: no master runs, and the window appears all the same."""
    window = screen.open_window()
    window.screen.do("type", "not-for-the-shell")
    window.click(place("address"))
    window.screen.do("mousemove", *place("terminalFrame"))
    window.screen.do("type", "not-for-the-shell")
    window.click(place("terminalFrame"))
    wait_until(window.terminal_has_keyboard, "the terminal has the keyboard")
    window.screen.do("mousemove", *place("video"))
    target = tmp_path / "typed"
    write_file(window, target, "for-the-shell")
    wait_until(lambda: target.exists() and target.read_text() == "for-the-shell\n", "the shell has run the line")
    assert "not-for-the-shell" not in window.terminal_text()


def test_f6_moves_the_keyboard_between_terminal_and_window(screen, wait_until):
    window = screen.open_window()
    window.enter_terminal()
    window.type("F6")
    wait_until(lambda: not window.terminal_has_keyboard(), "the window has the keyboard")
    window.type("F6")
    wait_until(window.terminal_has_keyboard, "the terminal has it again")


def test_keys_go_where_the_last_click_was_under_a_window_manager(screen, wait_until, place, run_program, tmp_path):
    run_program("openbox", "--sm-disable", env=screen.environment, stderr=subprocess.DEVNULL)
    window = screen.open_window()
    target = tmp_path / "typed"
    geometry = dict(
        line.split("=") for line in screen.do("getwindowgeometry", "--shell", window.id).split("\n") if "=" in line
    )
    left, top = int(geometry["X"]), int(geometry["Y"])
    place_in_window = lambda name: (place(name)[0] + left, place(name)[1] + top)  # noqa: E731
    window.click(place_in_window("address"))
    window.screen.do("mousemove", *place_in_window("terminalFrame"))
    window.screen.do("type", "not-for-the-shell")
    window.click(place_in_window("terminalFrame"))
    wait_until(window.terminal_has_keyboard, "the terminal has the keyboard")
    write_file(window, target, "after-a-click")
    wait_until(lambda: target.exists() and target.read_text() == "after-a-click\n", "the shell has run the line")
    assert "not-for-the-shell" not in window.terminal_text()


def test_a_window_managers_title_pushes_nothing_off_a_small_screen(screen, wait_until, run_program):
    run_program("openbox", "--sm-disable", env=screen.environment, stderr=subprocess.DEVNULL)
    window = screen.open_window()

    def ends():
        """Row below the window, where the screen is drawn on [px]."""
        corner = screen.do("mousemove", "--window", window.id, 0, 0, "getmouselocation", "--shell").split()
        size = screen.do("getwindowgeometry", "--shell", window.id).split()
        read = {line.partition("=")[0]: int(line.partition("=")[2]) for line in (*size, *corner)}
        return read["Y"] + read["HEIGHT"]

    wait_until(lambda: 640 < ends() <= 720, "its last line is on the screen")


def test_the_terminal_follows_the_size_of_the_window(screen, wait_until):
    window = screen.open_window()
    large = window.terminal_size()
    screen.do("windowsize", window.id, 1000, 620)
    wait_until(lambda: window.terminal_size() != large, "the terminal shrinks")
    columns, rows = map(int, large.split("x"))
    assert int(window.terminal_size().split("x")[1]) < rows
    screen.do("windowsize", window.id, 1280, 720)
    wait_until(lambda: window.terminal_size() == f"{columns}x{rows}", "the terminal grows again")


def test_a_closed_terminal_opens_again_with_a_click(screen, wait_until, place):
    window = screen.open_window()
    window.enter_terminal()
    window.screen.do("type", "exit")
    window.type("Return")
    wait_until(lambda: not window.terminal_text(), "the shell has ended")

    def reopen():
        window.click(place("terminalFrame"))
        return "$" in window.terminal_text()

    wait_until(reopen, "a click opens the terminal again")


@pytest.mark.parametrize("request_", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_nothing_is_left_whatever_ends_the_window(screen, wait_until, place, request_):
    window = screen.open_window()
    window.enter_terminal()
    window.screen.do("type", "sleep 1000")
    window.type("Return")
    wait_until(lambda: any("sleep" in command(pid) for pid in window.family()), "a program runs in the terminal")
    family = window.family()
    assert {"xterm", "tmux", "bash", "sleep"} <= {command(pid) for pid in family}
    # An xterm with nothing to draw, not even a text cursor, does not notice that its window is gone.
    window.click(place("video"))
    wait_until(lambda: not window.terminal_has_keyboard(), "the terminal is idle")
    processes.send(window.process.pid, request_)
    assert window.process.wait(15) == (-9 if request_ is signal.SIGKILL else 0)
    wait_until(lambda: not [pid for pid in family if command(pid)], "every process of the window has ended")
    assert not Path(
        os.environ.get("TMUX_TMPDIR", "/tmp"), f"tmux-{os.getuid()}", f"telepresence-{window.process.pid}"
    ).exists()


def test_exit_closes_the_window(screen, wait_until, place):
    window = screen.open_window()
    family = window.family()
    window.click(place("exitButton"))
    assert window.process.wait(15) == 0
    wait_until(lambda: not [pid for pid in family if command(pid)], "every process of the window has ended")


def test_roscore_start_types_the_reports_line_into_the_terminal(screen, wait_until, place):
    window = screen.open_window("--robot", "127.0.0.1:9", "--tell")
    window.click(place("roscoreButton"))
    line = (
        "roslaunch pepper_bringup tele_pepper.launch nao_ip:=127.0.0.1 roscore_ip:=127.0.0.1 nao_port:=9 "
        "conversation:=false sign_in:=false"
    )
    wait_until(lambda: line in window.terminal_text().replace("\n", ""), "the line is typed")
    assert not window.terminal_has_keyboard(), "a button leaves the keys to the pad"
    window.click(place("sessionButton"))
    wait_until(lambda: "this window connects when they answer" in window.output, "it waits for what is being started")


def test_the_old_command_line(screen):
    window = screen.open_window(program=("sh", "-c", f"cd {GUI_FOLDER} && exec python3 gui_main.py --no-sign-in"))
    processes.send(window.process.pid, signal.SIGTERM)
    assert window.process.wait(15) == 0


@pytest.mark.parametrize("display", ["", ":4711"])
def test_without_a_display_it_says_how_to_get_one(display):
    environment = {**os.environ, "DISPLAY": display}
    ended = subprocess.run([sys.executable, "-m", "gui"], env=environment, capture_output=True, text=True, timeout=30)
    assert ended.returncode == 2
    assert "no display" in ended.stderr and "./stack up" in ended.stderr and "Traceback" not in ended.stderr
    assert display_problem(environment) is not None


def test_a_window_that_a_new_master_does_not_know_starts_again_and_one_that_somebody_ends_does_not():
    """Our roslaunch leaves a window away whose exit code is 0: a person has closed it."""
    program = textwrap.dedent("""
        import sys
        from PyQt5.QtCore import QTimer
        from PyQt5.QtWidgets import QApplication, QMainWindow
        from gui.__main__ import _end_by_ros
        application, window = QApplication([]), QMainWindow()
        window.show()
        QTimer.singleShot(0, lambda: _end_by_ros(window, application, sys.argv[1]))
        sys.exit(application.exec_())
    """)
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    for reason, code in ((f"external shutdown request from [/master_keeper]: [{RESTARTED}]", os.EX_TEMPFAIL),
                         ("external shutdown request from [/rosnode]: [user request]", 0)):  # fmt: skip
        ended = subprocess.run([sys.executable, "-c", program, reason], env=environment, capture_output=True, text=True)
        assert ended.returncode == code, ended.stderr


def command(pid):
    """Name of a living process."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return ""
    name, state = stat[stat.index("(") + 1 : stat.rindex(")")], stat.rpartition(")")[2].split()[0]
    return "" if state == "Z" else name.split(":")[0]
