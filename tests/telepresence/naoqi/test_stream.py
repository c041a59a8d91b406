"""How a connection ends: what was sent before arrives, unless the peer counts as lost or the network stays away."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Iterator

import pytest
from machines import Machine

from telepresence.naoqi.connection import Connection
from telepresence.naoqi.dial import connect
from telepresence.naoqi.limits import Limits
from telepresence.naoqi.reactor import reactor

SENTENCE = b"May I come in?"
UNCONFIRMED = "04"
"""The state of a closed connection that still has to deliver something, FIN_WAIT1 (include/net/tcp_states.h)."""
GIVEN_UP_S = 20.0
"""Below the 30 s for which an open connection tries; the busiest machine wakes the kernel's timers sooner."""


@pytest.fixture
def machine() -> Iterator[Machine]:
    """A machine of its own, whose loopback can be cut. Needs root."""
    machine = Machine()
    yield machine
    machine.close()


@pytest.fixture
def ends(machine: Machine) -> Iterator[tuple[Connection, socket.socket]]:
    """A connection, and the bare socket at its other end."""
    reactor()  # outside, if it is not there yet: a thread and those that it starts stay on the machine of their birth
    with machine.entered(), socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        connection = connect(address, capabilities={}, limits=Limits(stalled_s=0.5))
        robot = listener.accept()[0]
    connection.start()
    with robot:
        robot.settimeout(GIVEN_UP_S)
        yield connection, robot
    connection.close()


def received(robot: socket.socket) -> bytes:
    """Return everything until the end of the connection."""
    data = b""
    with contextlib.suppress(ConnectionResetError):
        while piece := robot.recv(65536):
            data += piece
    return data


def wait_given_up(machine: Machine) -> None:
    """Wait until the kernel has nothing left to deliver."""
    deadline = time.monotonic() + GIVEN_UP_S
    while UNCONFIRMED in [row.split()[3] for row in machine.run("cat", "/proc/net/tcp").splitlines()]:
        assert time.monotonic() < deadline, "the kernel goes on sending"
        time.sleep(0.05)


def assert_silent(machine: Machine, robot: socket.socket) -> None:
    """Bring the network back; what no socket holds any more cannot come."""
    wait_given_up(machine)
    machine.run("ip", "link", "set", "lo", "up")
    robot.setblocking(False)
    with pytest.raises(BlockingIOError):
        robot.recv(65536)


def test_an_orderly_end_delivers_what_was_sent_before(ends) -> None:
    connection, robot = ends
    for _ in range(1000):
        connection.post(3, 1, 100, [SENTENCE])
    connection.finish("done")
    assert received(robot).count(SENTENCE) == 1000


@pytest.mark.parametrize("abort", [True, False], ids=["lost", "closed"])
def test_nothing_is_delivered_long_after_the_end(machine, ends, abort: bool) -> None:
    connection, robot = ends
    machine.run("ip", "link", "set", "lo", "down")
    assert connection.post(3, 1, 100, [SENTENCE])
    connection.close("closed", abort=abort)
    assert_silent(machine, robot)


def test_a_peer_that_reads_nothing_gets_nothing_later(machine, ends) -> None:
    connection, robot = ends
    machine.run("ip", "link", "set", "lo", "down")
    sent = bytes(64 * 1024)
    while connection.post(3, 1, 100, [sent]) and not connection._stream.queued:
        pass  # until the kernel takes no more
    deadline = time.monotonic() + GIVEN_UP_S
    while not connection.closed:
        assert time.monotonic() < deadline, "it is given up"
        time.sleep(0.05)
    assert "has read nothing" in connection.close_reason
    assert_silent(machine, robot)
