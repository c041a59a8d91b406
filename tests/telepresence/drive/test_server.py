"""The drive server's loop, with a base that notes what it is asked, and a pilot on loopback."""

from __future__ import annotations

import contextlib
import threading
import time

import pytest

from telepresence.drive.datagram import INFINITY
from telepresence.drive.link import DriveLink
from telepresence.drive.server import AT_REST, BREATH, CLEAR, SHORTEST_PERIOD, DrivenBase, DriveServer, Outcome


class Base(DrivenBase):
    def __init__(self) -> None:
        self.steps, self.hurry, self.stepped = 0, False, 0.0
        self.last = None, False
        """The command of the last step, and whether the pilot was cut off."""

    def step(self, now, command, goal, pilots):
        self.steps, self.stepped = self.steps + 1, now
        self.last = command and command[:3], pilots.cut
        return Outcome(CLEAR, "", AT_REST, (), INFINITY, -1, 0.0, False)

    def due(self):
        return self.stepped + 0.001 if self.hurry else INFINITY


@pytest.fixture
def base():
    return Base()


@pytest.fixture
def link(base, wait_until):
    server = DriveServer(base, "127.0.0.1", 0, None, lambda _line: None)
    thread = threading.Thread(target=server.run)
    thread.start()
    with contextlib.closing(server), contextlib.closing(DriveLink(f"127.0.0.1:{server.port}")) as link:
        wait_until(lambda: not link.problem, "the drive server answers")
        yield link
        server.stop()
        thread.join()


def test_a_pilot_whose_program_freezes_is_stopped_as_a_cut_is(base, link, wait_until):
    link.drive(0.2, 0.0, 0.0)
    wait_until(lambda: base.last[0] == (0.2, 0.0, 0.0), "it drives")
    wait_until(lambda: base.last[0] is None, "nobody repeats the velocity")
    assert base.last == (None, True)
    link.release()
    wait_until(lambda: base.last == (None, False), "letting go is no cut")


def test_a_base_that_tries_again_and_again_floods_nobody_with_reports(base, link, wait_until):
    base.hurry = True
    began, first, steps = time.monotonic(), link.report()[0].seq, base.steps
    wait_until(lambda: base.steps > steps + 300, "it is asked often")
    reports, seconds = link.report()[0].seq - first, time.monotonic() - began
    assert reports <= 2 + seconds / SHORTEST_PERIOD


def test_a_flood_lets_the_server_rest_or_linux_would_take_its_priority(base, monkeypatch):
    server = DriveServer(base, "127.0.0.1", 0, None, lambda _line: None)
    waits: list[float] = []

    class Flooded:
        """A socket in which there is always another datagram."""

        fileno = server._socket.fileno

        def recvfrom(self, _size: int) -> tuple[bytes, tuple[str, int]]:
            return b"?", ("127.0.0.1", 9)

    with contextlib.closing(server), monkeypatch.context() as patched:
        patched.setattr(server, "_socket", Flooded())
        patched.setattr("telepresence.drive.server.time.sleep", waits.append)
        server._listen(0.0)
    assert waits == [BREATH]
