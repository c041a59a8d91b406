"""Programs that are forked from a process which has imported rospy, as our roslaunch does it: interpreters of their own
for the hundreds that tests start take a tenth of the whole suite's processor time."""

from __future__ import annotations

import functools
import hashlib
import os
import select
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import IO, Any

from telepresence_ros.fork_server import STREAMS, Program
from telepresence_ros.forked_process import ForkedProcess, ForkServer, can_be_forked, has_our_settings

from telepresence.station import processes
from telepresence.temporary_folder import TemporaryFolder

FOR_ANY_PYTHON = ("rosmaster", "rosparam", "rosservice", "rostopic")
"""Programs of Debian whose first line names another interpreter, and that ours runs as well."""
KNOWN = {"env", "stdin", "stdout", "stderr", "text", "cwd"}
"""What a fork can be given of what `subprocess.Popen` takes."""


def _network_namespace() -> int:
    return os.stat("/proc/thread-self/ns/net").st_ino


OURS = _network_namespace()
"""What is forked is in this one, wherever the thread is that asks for it."""


class ForkedProgram(ForkedProcess):
    """A forked program with what tests use of `subprocess.Popen`."""

    def __init__(self, server: ForkServer, program: Program, streams: Streams) -> None:
        self.args = program.words
        self.stdin, self.stdout, self.stderr = (streams.ours.get(number) for number in range(3))
        super().__init__(server, server.start(program, [streams.theirs[number] for number in STREAMS]))

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            signal.pidfd_send_signal(self._descriptor, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Raises `subprocess.TimeoutExpired`."""
        if self.poll() is None:
            poll = select.poll()
            poll.register(self._descriptor, select.POLLIN)
            if not poll.poll(None if timeout is None else max(0.0, 1000.0 * timeout)):
                raise subprocess.TimeoutExpired(self.args, timeout)
        return self.poll()

    def communicate(self, timeout: float) -> tuple[Any, Any]:
        """Close its input; return what it prints and its errors, to their end. Raises `subprocess.TimeoutExpired`."""
        if self.stdin is not None:
            self.stdin.close()
        with ThreadPoolExecutor() as readers:
            texts = [readers.submit(pipe.read) if pipe else None for pipe in (self.stdout, self.stderr)]
            try:
                self.wait(timeout)
            except subprocess.TimeoutExpired:
                self.kill()  # or its pipes never end
                raise
            output, errors = (text.result() if text else None for text in texts)
        return output, errors


class Streams:
    """Standard input, output and error of a program, of what `subprocess.Popen` takes for them; `with` it, the
    program's ends are closed here afterwards.

    Attributes:
        theirs: Descriptors by number.
        ours: Our ends of pipes, by number.
    """

    def __init__(self, wanted: Mapping[int, IO | int | None], text: bool) -> None:
        self._opened: list[int] = []
        self._kind = "" if text else "b"
        self.theirs: dict[int, int] = {}
        self.ours: dict[int, IO] = {}
        for number in STREAMS:
            self.theirs[number] = self._open(number, wanted[number])

    def __enter__(self) -> Streams:
        return self

    def __exit__(self, *_exception: object) -> None:
        for descriptor in self._opened:
            os.close(descriptor)

    def _open(self, number: int, wanted: IO | int | None) -> int:
        if wanted is None:
            return number
        if wanted == subprocess.STDOUT:
            return self.theirs[1]
        if wanted == subprocess.DEVNULL:
            self._opened.append(os.open(os.devnull, os.O_RDWR))
        elif wanted == subprocess.PIPE:
            reader, writer = os.pipe()
            self._opened.append(writer if number else reader)
            self.ours[number] = open(reader if number else writer, ("r" if number else "w") + self._kind)
        else:
            return wanted if isinstance(wanted, int) else wanted.fileno()
        return self._opened[-1]


def start(argv: Sequence[str], **popen: Any) -> subprocess.Popen | ForkedProgram:
    """Do what `processes.start` does, by a fork where that can be: for nodes of the workspace, ROS masters, and Python
    that uses rospy."""
    environment = popen.get("env") or dict(os.environ)
    words = _script(argv, environment) if popen.keys() <= KNOWN and _network_namespace() == OURS else None
    if words is None:
        return processes.start(argv, **popen)
    wanted = {0: popen.get("stdin"), 1: popen.get("stdout"), 2: popen.get("stderr")}
    with Streams(wanted, popen.get("text", False)) as streams:
        program = Program(words, environment, os.fspath(popen.get("cwd") or os.getcwd()))
        return ForkedProgram(_server(), program, streams)


def _script(argv: Sequence[str], environment: Mapping[str, str]) -> list[str] | None:
    """Return the script that a command line runs, and its arguments; None where it cannot be forked."""
    name, *arguments = argv
    if name in FOR_ANY_PYTHON:
        return [shutil.which(name) or name, *arguments]
    if name != sys.executable:
        return list(argv) if can_be_forked(argv, environment) else None
    if not has_our_settings(environment):
        return None
    if arguments[0] == "-c":
        return [str(_written(arguments[1])), *arguments[2:]] if "rospy" in arguments[1] else None
    file = Path(arguments[0])
    return arguments if file.suffix == ".py" and "rospy" in file.read_text() else None


def _written(code: str) -> Path:
    """Return a script with this text."""
    file = _folder().path / f"{hashlib.sha256(code.encode()).hexdigest()[:16]}.py"
    file.write_text(code)
    return file


@functools.cache
def _folder() -> TemporaryFolder:
    return TemporaryFolder("telepresence-tests-scripts-")


@functools.cache
def _server() -> ForkServer:
    return ForkServer()


def end() -> None:
    """End the process that forks; what it has started goes on."""
    for made in (_server, _folder):
        if made.cache_info().currsize:
            made().close()
            made.cache_clear()
