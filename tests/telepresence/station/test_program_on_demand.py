"""A program that starts with its first visitor."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest

from telepresence.station import processes
from telepresence.station.program_on_demand import ProgramOnDemand
from telepresence.station.vitals import PERIOD
from telepresence.web.listener import listener

PORTER = """
import os, socket, sys
listening = socket.socket(fileno=int(sys.argv[1]))
while True:
    visitor, _ = listening.accept()
    visitor.sendall(b"%d\\n" % os.getpid())
    visitor.close()
"""


@pytest.fixture
def faults() -> list[tuple[str, ...]]:
    return []


@pytest.fixture
def program(faults) -> Iterator[ProgramOnDemand]:
    listening = listener("127.0.0.1", 0)

    def start() -> subprocess.Popen:
        number = listening.fileno()
        return processes.start([sys.executable, "-c", PORTER, str(number)], pass_fds=[number])

    on_demand = ProgramOnDemand("porter", listening, start, lambda *fault: faults.append(fault))
    on_demand.address = listening.getsockname()  # type: ignore[attr-defined]
    yield on_demand
    on_demand.close(patience=5.0)
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(on_demand.address, timeout=5.0)  # type: ignore[attr-defined]


def visited(program, wait_until) -> int:
    """The process id that a visitor is told."""
    with socket.create_connection(program.address, timeout=30.0) as visitor:
        wait_until(lambda: program.poll(PERIOD) or select.select([visitor], [], [], 0.0)[0], "the program answers")
        return int(visitor.recv(64))


def test_it_starts_with_the_first_visitor_and_again_when_it_dies(program, faults, wait_until):
    for _ in range(5):
        program.poll(PERIOD)
    assert program.pid == 0
    first = visited(program, wait_until)
    assert first == program.pid
    assert visited(program, wait_until) == first
    os.kill(first, signal.SIGKILL)
    wait_until(lambda: program.poll(PERIOD) or program.pid != first, "it starts again")
    assert visited(program, wait_until) == program.pid != first
    assert faults == [("porter", "died: signal 9", "starts again")]


def test_nobody_comes_and_nothing_is_left(program):
    program.poll(PERIOD)
    assert program.pid == 0
