"""A terminal that is paused, or closed, holds nobody up; a real one, with Ctrl-S and Ctrl-Q."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.station import terminal_printer

PROGRAM = textwrap.dedent("""
    import contextlib, logging, signal, sys
    from pathlib import Path
    from telepresence.station.terminal_printer import TerminalPrinter
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with TerminalPrinter(Path("/logs")) as printer:
        with contextlib.suppress(OSError):
            for word in sys.stdin:
                for number in range(int(word)):
                    printer.say(f"line {number}")
                printer.warn("[WARN] [1.5]: a warning")
                logging.warning("a record")
                Path(sys.argv[1]).write_text(word)
        printer.say("nobody reads this")
""")
MANY = 20_000
"""Lines that no buffer of a terminal holds."""


@pytest.fixture
def program(tmp_path):
    terminal = Terminal(sys.executable, "-c", PROGRAM, str(tmp_path / "done"))
    yield terminal
    terminal.close()


@pytest.fixture
def done(tmp_path, wait_until):
    """Wait until the program has said this many lines."""

    def wait(count):
        wait_until(
            lambda: (tmp_path / "done").exists() and (tmp_path / "done").read_text() == f"{count}\n", "all is said"
        )

    return wait


def shown(terminal):
    return terminal.seen.replace("\r", "").splitlines()


def test_lines_come_in_their_order_and_warnings_in_colour(program, done, wait_until):
    program.type("3\n")
    done(3)
    wait_until(lambda: "a record" in program.seen, "all is shown")
    assert shown(program)[-5:] == ["line 0", "line 1", "line 2", "\33[33m[WARN] [1.5]: a warning\33[0m", "a record"]


def test_a_paused_terminal_holds_nobody_up_and_shows_the_newest_later(program, done, wait_until):
    program.type("1\n")
    done(1)
    program.type(f"{MANY}\n")
    program.pause()
    done(MANY)
    program.resume()
    wait_until(lambda: program.seen.count("a record") == 2, "the rest is shown")
    numbers = [int(line.removeprefix("line ")) for line in shown(program) if line.startswith("line ")][1:]
    assert numbers == sorted(numbers) and numbers[-1] == MANY - 1
    assert "lines are left out here; those of programs are in /logs" in program.seen
    assert len(numbers) >= terminal_printer.MOST_WAITING - 2


def test_a_program_ends_though_its_terminal_is_paused(program, done, wait_until):
    program.type("1\n")
    done(1)
    program.type(f"{MANY}\n\4")
    program.pause()
    wait_until(lambda: program.process.poll() is not None, "it ends")
    assert program.process.returncode == 0


def test_a_closed_terminal_ends_nobody(program, done, wait_until):
    program.type("1\n")
    done(1)
    program.hang_up()
    wait_until(lambda: program.process.poll() is not None, "it ends")
    assert program.process.returncode == 0


def test_a_terminal_that_refuses_to_wait_gets_all_of_it():
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    program = "from telepresence.station.terminal_printer import _write; _write(1, bytes(1_000_000))"
    process = subprocess.Popen([sys.executable, "-c", program], stdout=writing)
    os.close(writing)
    with open(reading, "rb") as pipe:
        assert len(pipe.read()) == 1_000_000
    assert process.wait(10.0) == 0
