"""roslaunch's side of `telepresence_ros.fork_server`: starts nodes there that can be started so, and watches them."""

from __future__ import annotations

import json
import logging
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from telepresence.station import vitals
from telepresence.station.adopted import UNKNOWN, is_readable
from telepresence_ros.fork_server import LONGEST, Program

_log = logging.getLogger(__name__)

PATIENCE = 5.0
"""Seconds within which a server that serves must answer; it starts a program in 0.02 s."""
IMPORT_PATIENCE = 60.0
"""Seconds within which it must serve: it imports for 0.5 s, or for many times that where others use the processors. One
that dies or is stopped meanwhile is noticed at once, by `NodeStarter.poll`."""
TERMINAL = "TELEPRESENCE_TERMINAL"
"""Marks a node in a launch file that reads keys from the terminal: what it prints is for the person there, even where
the output of the others goes elsewhere, as in `./stack up`."""
LEAST_LIFE = 2.0
"""Seconds that a server must have lived for another one to take its place: what cannot run is not tried for ever."""
LONGEST_TITLE = 4096
"""Bytes of a command line, as `ps` shows it: room is made for it in the server's own."""
_SAME = (
    "LD_LIBRARY_PATH",
    "LD_PRELOAD",
    "PYTHONPATH",
    "PYTHONHOME",
    "PYTHONWARNINGS",
    "PYTHONOPTIMIZE",
    "PYTHONDEVMODE",
)
"""Environment variables that count when an interpreter starts: a node that wants others gets one of its own."""


class ForkServerGone(Exception):
    """The server has died, or does not answer."""


class ForkServer:
    """The process that forks. It ends when this one does; what it has started goes on."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.settimeout(IMPORT_PATIENCE)
        for end in (ours, theirs):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 2 * LONGEST)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "telepresence_ros.fork_server", str(theirs.fileno()), "-" * LONGEST_TITLE],
                pass_fds=[theirs.fileno()],
                start_new_session=True,
                # A pool of threads would not survive the fork, and no node multiplies large matrices.
                # SPT_NOENV: a program's name leaves /proc/PID/environ alone, by which a station finds its programs.
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "SPT_NOENV": "1"},
            )
        self._channel = ours
        self._lock = threading.Lock()
        self._ended: dict[int, int] = {}
        self._started = time.monotonic()

    @property
    def age(self) -> float:
        """Seconds since it was started."""
        return time.monotonic() - self._started

    def failure(self) -> str:
        """What has befallen it; see `vitals.failure`."""
        return vitals.failure(self._process)

    def start(self, program: Program, streams: Sequence[int]) -> int:
        """Start a program; its process id.

        Args:
            streams: Descriptors of its standard output and error, and of its input if it does not share ours.
        Raises:
            ForkServerGone: Nothing was started.
        """
        text = json.dumps(asdict(program)).encode()
        if len(text) > LONGEST:
            raise ForkServerGone("arguments and environment are too long")
        with self._lock:
            try:
                socket.send_fds(self._channel, [text], list(streams))
                return self._read_started()
            except TimeoutError as error:
                return self._started_after_all(error)
            except OSError as error:
                raise ForkServerGone(str(error)) from error

    def _read_started(self) -> int:
        while True:
            answer = self._read()
            if "started" in answer:
                return answer["started"]

    def _started_after_all(self, error: TimeoutError) -> int:
        """End a server that does not answer: nothing may be started by it once it has been started elsewhere."""
        self._process.kill()
        self._process.wait()
        try:
            return self._read_started()  # it had, and could not say so in time
        except OSError:
            raise ForkServerGone(f"it does not answer: {error}") from error

    def exit_code(self, process: int) -> int:
        """Return the exit code of a program that has ended; `UNKNOWN` when the server has ended, too."""
        with self._lock:
            try:
                while process not in self._ended:
                    self._read()
            except OSError:
                return UNKNOWN
            return self._ended.pop(process)

    def close(self) -> None:
        """End the server."""
        self._channel.close()
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def kill(self) -> None:
        """End a server that has died or is frozen; who waits for it learns that it has gone."""
        self._process.kill()
        self._process.wait()
        with self._lock:
            self._channel.close()

    def _read(self) -> dict[str, int]:
        text = self._channel.recv(LONGEST)
        if not text:
            raise ConnectionResetError("the fork server has ended")
        answer: dict[str, int] = json.loads(text)
        if "serves" in answer:
            self._channel.settimeout(PATIENCE)
        if "ended" in answer:
            self._ended[answer["ended"]] = answer["code"]
        return answer


class ForkedProcess:
    """What `subprocess.Popen` is for a child, for a program that the server has forked."""

    def __init__(self, server: ForkServer, pid: int) -> None:
        self._server, self.pid = server, pid
        self.returncode: int | None = None
        self._descriptor: int | None = None
        try:
            self._descriptor = os.pidfd_open(pid)
        except ProcessLookupError:  # it has ended at once, and the server has noticed before
            self.returncode = server.exit_code(pid)

    def poll(self) -> int | None:
        """None while it runs."""
        if self.returncode is None and self._descriptor is not None and is_readable(self._descriptor):
            self.returncode = self._server.exit_code(self.pid)
        return self.returncode

    def __del__(self) -> None:
        if self._descriptor is not None:
            os.close(self._descriptor)


class NodeStarter:
    """Has nodes forked where that can be, and starts the others as `subprocess.Popen` does."""

    def __init__(self) -> None:
        self._server: ForkServer | None = ForkServer()
        self._changing = threading.Lock()

    def poll(self) -> tuple[str, str] | None:
        """Put another server in the place of one that has died or was stopped; return what befell it and what comes
        next, in the words of a fault, or None."""
        with self._changing:
            server = self._server
            if server is None or not (failure := server.failure()):
                return None
            again = server.age >= LEAST_LIFE
            self._server = ForkServer() if again else None
        server.kill()
        return failure, "starts again" if again else "programs start more slowly from now on"

    def start(self, words: list[str], **popen: Any) -> ForkedProcess | subprocess.Popen:
        """Start a program; takes what roslaunch gives `subprocess.Popen`."""
        if popen["env"].get(TERMINAL) == "true" and popen["stdout"] is None and not sys.stdout.isatty():
            popen["stdout"] = sys.stderr
        files = [popen["stdout"] or sys.stdout, popen["stderr"] or sys.stderr]
        pipes = any(isinstance(file, int) for file in files)  # that Popen is to make
        server = self._server
        if server is None or pipes or not can_be_forked(words, popen["env"]):
            return subprocess.Popen(words, **popen)
        try:
            program = Program(words, popen["env"], popen["cwd"])
            pid = server.start(program, [file.fileno() for file in files])
            return ForkedProcess(server, pid)
        except ForkServerGone as error:
            self._do_without(server, error)
            return subprocess.Popen(words, **popen)

    def _do_without(self, server: ForkServer, error: ForkServerGone) -> None:
        with self._changing:
            if self._server is not server:
                return  # another one has taken its place
            self._server = None
        _log.warning("programs start more slowly from now on: %s", error)
        server.close()

    def close(self) -> None:
        """End the server; what it has started goes on."""
        if self._server is not None:
            self._server.close()


def can_be_forked(words: Sequence[str], environment: dict[str, str]) -> bool:
    """Return whether this program is a script for the interpreter that runs here, with the same settings."""
    if not has_our_settings(environment) or not os.access(words[0], os.X_OK):
        return False
    try:
        with Path(words[0]).open("rb") as file:
            first = file.readline(512)
    except OSError:
        return False
    interpreter = first[2:].split() if first[:2] == b"#!" else []
    return len(interpreter) == 1 and Path(os.fsdecode(interpreter[0])).parent == Path(sys.executable).parent


def has_our_settings(environment: Mapping[str, str]) -> bool:
    """Return whether an interpreter in this environment would be like ours."""
    return all(environment.get(name) == os.environ.get(name) for name in _SAME)
