"""A stranger without a sign-in holds connections to the pilot's page, more than its program may open files.

Whoever has a way in comes in meanwhile, and the pilot drives on.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import resource
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from page_in_process import PageInProcess
from page_server import ANNA, WILL
from page_stranger import FORWARD, Pilot, Stranger

from telepresence.page.attempts import MOST
from telepresence.security.log_flood import BURST
from telepresence.station import processes

CROWD = Path(__file__).resolve().parents[1] / "lab" / "idle_crowd.py"
FILES = 256
"""That the page's program may open: fewer than the crowd has connections."""
WITHIN = 3.0
"""[s] for somebody to come in."""
SILENCE = 5.0
"""[s] for which the page may tell the pilot nothing: more than a busy machine holds it up."""
STRANGER = "127.0.0.9"


@pytest.fixture
def few_files() -> Iterator[None]:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, before)


@pytest.fixture
def page(few_files: None, tmp_path: Path) -> Iterator[PageInProcess]:
    served = PageInProcess(tmp_path)
    yield served
    served.close()


@contextlib.contextmanager
def crowd(page: Stranger, manner: str) -> Iterator[None]:
    """A stranger's connections are there, and come again."""
    program = processes.start(
        [sys.executable, str(CROWD), page.host, str(page.port), STRANGER, manner],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    watchdog = threading.Timer(60.0, program.kill)
    watchdog.start()
    try:
        assert program.stdout.readline() == "full\n"
        yield
    finally:
        watchdog.cancel()
        program.communicate(timeout=20.0)


@pytest.mark.parametrize("manner", ["plain", "encrypted", "half a request"])
def test_a_stranger_holds_more_connections_than_there_are_files(
    page: PageInProcess, wait_until: Callable, manner: str
) -> None:
    stranger, robot = Stranger(page.url), page.robots["Pepper"]
    with Pilot(stranger, stranger.enter(**ANNA)) as pilot:
        wait_until(lambda: robot.velocity.vx == FORWARD[0], "anna drives")
        with crowd(stranger, manner):
            pilot.silence, took = 0.0, []
            for _ in range(MOST // 2):
                began = time.monotonic()
                cookie = stranger.enter(**WILL)
                assert cookie and stranger.ask("GET", "/me", cookie=cookie)[0] == 200
                took.append(time.monotonic() - began)
            assert statistics.median(took) < WITHIN
            with stranger.open(cookie) as looking:
                assert "state" in next(text for text in looking if isinstance(text, str))
        assert not pilot.hung_up and pilot.silence < SILENCE
        assert ("I", "nobody") not in itertools.pairwise(pilot.had)


def test_requests_that_cannot_be_read_fill_the_log(page: PageInProcess, caplog: pytest.LogCaptureFixture) -> None:
    """They get an answer, and write a line a second."""
    caplog.set_level(logging.INFO)
    stranger, began = Stranger(page.url), time.monotonic()
    for unreadable in (
        b"GET / HTTP/1\r\n\r\n",
        b"GET / HTTP/1.1\r\nContent-Length: x\r\n\r\n",
        b"POST /enter HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Encoding: gzip\r\nContent-Length: 5\r\n\r\nhello",
    ):
        for _ in range(20):
            with socket.create_connection((stranger.host, stranger.port), timeout=10.0) as plain:
                with stranger.context.wrap_socket(plain) as client:
                    client.sendall(unreadable)
                    assert b" 400 " in client.recv(100)
    assert not any(record.exc_info for record in caplog.records)
    assert len(caplog.records) <= BURST + 2 + time.monotonic() - began
