"""Nodes that are forked from a process which has imported rospy, as our roslaunch does it: interpreters of their own
for the hundreds that tests start take a tenth of the whole suite's processor time."""

from __future__ import annotations

import functools
import os
import select
import shutil
import signal
import subprocess
from collections.abc import Sequence
from typing import IO, Any

from telepresence_ros.fork_server import Program
from telepresence_ros.forked_process import ForkedProcess, ForkServer, can_be_forked

from telepresence.station import processes

FOR_ANY_PYTHON = ("rosmaster",)
"""Programs of Debian whose first line names another interpreter, and that ours runs as well."""


def _network_namespace() -> int:
    return os.stat("/proc/thread-self/ns/net").st_ino


OURS = _network_namespace()
"""What is forked is in this one, wherever the thread is that asks for it."""


class ForkedProgram(ForkedProcess):
    """A forked node with what tests use of `subprocess.Popen`."""

    def __init__(self, server: ForkServer, argv: Sequence[str], environment: dict[str, str], output: list[int]) -> None:
        self.args = list(argv)
        super().__init__(server, server.start(Program(self.args, environment, os.getcwd()), output))

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


def start(argv: Sequence[str], **popen: Any) -> subprocess.Popen | ForkedProgram:
    """Do what `processes.start` does, by a fork where that can be: a node of the workspace, or a ROS master, without
    pipes."""
    environment, output, errors = popen.get("env") or dict(os.environ), popen.get("stdout"), popen.get("stderr")
    words = [(argv[0] in FOR_ANY_PYTHON and shutil.which(argv[0])) or argv[0], *argv[1:]]
    plain = popen.keys() <= {"env", "stdin", "stdout", "stderr"} and popen.get("stdin") in (None, subprocess.DEVNULL)
    if plain and _network_namespace() == OURS and (argv[0] in FOR_ANY_PYTHON or can_be_forked(words, environment)):
        targets = [output, output if errors == subprocess.STDOUT else errors]
        if all(target == subprocess.DEVNULL or not isinstance(target, int | None) for target in targets):
            return _fork(words, environment, targets)
    return processes.start(argv, **popen)


def _fork(words: Sequence[str], environment: dict[str, str], targets: Sequence[IO | int]) -> ForkedProgram:
    with open(os.devnull, "w") as nothing:
        files = [nothing if target == subprocess.DEVNULL else target for target in targets]
        return ForkedProgram(_server(), words, environment, [file.fileno() for file in files])


@functools.cache
def _server() -> ForkServer:
    return ForkServer()


def end() -> None:
    """End the process that forks; what it has started goes on."""
    if _server.cache_info().currsize:
        _server().close()
        _server.cache_clear()
