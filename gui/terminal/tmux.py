"""A tmux server of the window's own, and typing into its windows.

It has its own socket and configuration, so the pilot's sessions and settings are not touched. The server ends with its
only session, and the session with its only client (`destroy-unattached`). `start_reaper` makes sure that it also ends
when this process is killed.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

SESSION = "my_session"
"""The report's name: in the window's terminal `tmux send-keys -t my_session:0 ...` types into this session."""
FIRST_WINDOW = "session"
SHELL = "bash"
TIMEOUT = 5.0  # seconds for one tmux command; they take milliseconds
INTERRUPT_PERIOD = 3.0
"""[s] between two Ctrl-C. A program that still starts can lose one: roslaunch imports a module in a `try` that catches
everything. Once it is ending, it ignores the next ones."""
LOOK_PERIOD = 0.2  # s between two looks at what still runs
_REAP = """
read -r _
socket=$1; shift
# The server may have ended by itself, or may not be up yet.
for attempt in 1 2 3; do "$@" kill-server 2>/dev/null && break; sleep 0.1; done
rm -f "$socket" "$socket-left"
"""
_HERE = Path(__file__).resolve().parent


class TmuxError(RuntimeError):
    """tmux did not do what it was asked for; the message is for the pilot."""


class Tmux:
    """A tmux server, started by `attach_command`. Calls block for milliseconds, so they must not run on Qt's thread.

    Args:
        socket: Name of the server's socket, unique on this machine.
    """

    def __init__(self, socket: str) -> None:
        self._base = ["tmux", "-L", socket]
        # The path that -L stands for, see tmux(1). tmux leaves the file behind.
        self.socket = Path(os.environ.get("TMUX_TMPDIR", "/tmp"), f"tmux-{os.getuid()}", socket)
        self.left = self.socket.with_name(f"{socket}-left")
        """A file that whoever runs `attach_command` makes when it has ended well: its last shell was left."""
        shell = shlex.join([SHELL, "--noprofile", "--rcfile", str(_HERE / "terminal.bashrc"), "-i"])
        self.attach_command = [
            *self._base, "-f", str(_HERE / "tmux.conf"),
            "new-session", "-s", SESSION, "-n", FIRST_WINDOW, shell,
            ";", "set-option", "-g", "default-command", shell,
            ";", "set-option", "-g", "destroy-unattached", "on",
        ]  # fmt: skip
        """The command to run in a terminal window."""

    def was_left(self) -> bool:
        """Whether there is that file; it is removed."""
        found = self.left.exists()
        self.left.unlink(missing_ok=True)
        return found

    def type_line(self, window: str, line: str) -> None:
        """Type a line and Enter at the shell's prompt in `window`, which is opened if necessary and shown.

        Raises:
            TmuxError: A program runs in that window, or the terminal is closed.
        """
        self._wait_for_session()
        if window in self.windows():
            self._call("select-window", "-t", self._target(window))
        else:
            self._call("new-window", "-t", f"{SESSION}:", "-n", window)
        program = self._wait_for_prompt(window)
        if program:
            raise TmuxError(f"{program} runs in the terminal's window '{window}'. End it there with Ctrl-C first.")
        # tmux would take a semicolon at the end of an argument as the end of its own command.
        literal = line[:-1] + "\\;" if line.endswith(";") else line
        column, row, width = self._cursor(window)
        self._call("send-keys", "-t", self._target(window), "-l", literal)
        self._call("send-keys", "-t", self._target(window), "Enter")
        self._wait_for_new_row(window, row, row + (column + len(line)) // width + 1)

    def end_program(self, window: str, patience: float, given_up: Callable[[], bool]) -> str:
        """Type Ctrl-C in `window` until its shell waits for a line, at most `patience` seconds or until `given_up`.

        Returns:
            What `program` returns then: empty when the program has ended.

        Raises:
            TmuxError: tmux does not answer.
        """
        self._interrupt(window)
        interrupted = time.monotonic()
        deadline = interrupted + patience
        while (left := self.program(window)) and time.monotonic() < deadline and not given_up():
            if time.monotonic() > interrupted + INTERRUPT_PERIOD:
                self._interrupt(window)
                interrupted = time.monotonic()
            time.sleep(LOOK_PERIOD)
        return left

    def program(self, window: str) -> str:
        """Return the program that runs in `window`; empty when its shell waits for a line, or there is no such window.

        Raises:
            TmuxError: tmux does not answer.
        """
        if not self._has_session() or window not in self.windows():
            return ""
        answer = self._call("display-message", "-p", "-t", self._target(window), "#{pane_current_command}")
        return "" if answer == SHELL else answer

    def windows(self) -> list[str]:
        """Return the names of the open windows.

        Raises:
            TmuxError: The terminal is closed.
        """
        return self._call("list-windows", "-t", SESSION, "-F", "#{window_name}").split("\n")

    def text(self, window: str) -> str:
        """Return what `window` shows.

        Raises:
            TmuxError: There is no such window.
        """
        return self._call("capture-pane", "-p", "-t", self._target(window))

    def start_reaper(self) -> subprocess.Popen:
        """Start a process that ends the server, and thereby everything in it, when its standard input is closed: by
        this process, or by the kernel when this process is killed. xterm alone could live on until it next draws."""
        return subprocess.Popen(
            ["sh", "-c", _REAP, "tmux-reaper", str(self.socket), *self._base],
            stdin=subprocess.PIPE,
            env=environment(),
            start_new_session=True,
        )

    def _target(self, window: str) -> str:
        return f"{SESSION}:={window}"

    def _interrupt(self, window: str) -> None:
        if self._has_session() and window in self.windows():
            # A pane that is being scrolled (copy mode) would take the key itself.
            self._call("copy-mode", "-q", "-t", self._target(window))
            self._call("send-keys", "-t", self._target(window), "C-c")

    def _has_session(self) -> bool:
        return self._run("has-session", "-t", SESSION).returncode == 0

    def _wait_for_session(self, timeout: float = TIMEOUT) -> None:
        """Wait until the terminal is open: a line may be requested before that."""
        deadline = time.monotonic() + timeout
        while not self._has_session():
            if time.monotonic() > deadline:
                raise TmuxError("The terminal is closed. Open it again with a click on it.")
            time.sleep(0.05)

    def _wait_for_prompt(self, window: str, timeout: float = 2.0) -> str | None:
        """Wait for the shell's prompt; return None, or the name of the program that keeps running there."""
        deadline = time.monotonic() + timeout
        while True:
            answer = self._call(
                "display-message", "-p", "-t", self._target(window), "#{cursor_x} #{pane_current_command}"
            )
            column, program = answer.split(" ", 1)
            if program == SHELL and int(column) > 0:
                return None
            if time.monotonic() > deadline:
                return program
            time.sleep(0.05)

    def _cursor(self, window: str) -> tuple[int, int, int]:
        """Return column and row of the cursor, counted from the first row of the history, and the columns of a row."""
        answer = self._call(
            "display-message", "-p", "-t", self._target(window),
            "#{cursor_x} #{history_size} #{cursor_y} #{pane_width}",
        )  # fmt: skip
        column, history, row, width = map(int, answer.split())
        return column, history + row, width

    def _wait_for_new_row(self, window: str, row: int, expected: int, timeout: float = 1.0) -> None:
        """Wait until the shell has read the line that was typed in `row`: until then it looks as if it were at the
        prompt, and a line typed next would reach the program. Rows shrink when the line clears the screen; a shell that
        does not read it in time is busy."""
        deadline = time.monotonic() + timeout
        while row <= self._cursor(window)[1] < expected and time.monotonic() < deadline:
            time.sleep(0.02)

    def _call(self, *words: str) -> str:
        done = self._run(*words)
        if done.returncode != 0:
            raise TmuxError(f"The terminal refused: {done.stderr.strip()}")
        return done.stdout.removesuffix("\n")

    def _run(self, *words: str) -> subprocess.CompletedProcess[str]:
        try:
            return subprocess.run(
                [*self._base, *words], capture_output=True, text=True, timeout=TIMEOUT, env=environment()
            )
        except FileNotFoundError:
            raise TmuxError("tmux is not installed. Install it with:  ./stack build") from None
        except subprocess.TimeoutExpired:
            raise TmuxError(f"tmux did not answer within {TIMEOUT:.0f} s.") from None


def environment() -> dict[str, str]:
    """Return the environment without what makes tmux believe that it runs inside another tmux."""
    return {name: value for name, value in os.environ.items() if name not in ("TMUX", "TMUX_PANE")}
