"""The simulated Robotino's web server under 300 requests a second, against a handler that answers a constant.

Ten clients on a common schedule; a request that is late starts late and its waiting counts. Half of them keep their
connection, half open one for each request, as public programs do. Both servers run in processes of their own.
"""

from __future__ import annotations

import http.client
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path

from report import Row, percentile

from telepresence.station import processes
from telepresence.web.server import WebServer

RATE, SECONDS = 300, 30.0
SAME_SERVER = "constant answer, same server"
LIMIT = 25.0
"""What p99 may be [ms]."""
CLIENTS = 10
FULL_SPEED = 5.0
"""Seconds during which as many requests as possible are sent."""
ODOMETRY_RATE = 20.0
"""Readings per simulated second (vendor's controld3)."""
REQUESTS = [
    ("PUT", "/data/omnidrive", b"[0.1,0,0.3]"),
    ("GET", "/data/odometry", None),
    ("GET", "/data/distancesensorarray", None),
    ("GET", "/data/bumper", None),
    ("POST", "/data/omnidrive", b"[0.1,0,0.3]"),
    ("GET", "/data/powermanagement", None),
    ("GET", "/data/analoginputarray?sid=bench", None),
    ("GET", "/data/digitalinputarray", None),
    ("GET", "/data/imageversion", None),
    ("GET", "/data/controllerinfo", None),
]
PICTURE = ("GET", "/cam0", None)
PICTURE_EVERY = 30
"""Requests per picture: ten a second."""


def run() -> list[Row]:
    with server("-m", "robotino_sim", "--port", "0") as address:
        first, begin = odometry(address), time.monotonic()
        ours = under_load(address, with_pictures=True)
        factor = (odometry(address) - first) / ODOMETRY_RATE / (time.monotonic() - begin)
        ours_most = full_speed(address)
    with server(__file__) as address:
        bare = under_load(address, with_pictures=False)
        bare_most = full_speed(address)
    asked = int(RATE * SECONDS)
    return [
        Row("answered, of 300/s for 30 s", len(ours), asked, "requests", "asked"),
        Row("answer, p50", percentile(ours, 50) * 1e3, percentile(bare, 50) * 1e3, "ms", SAME_SERVER),
        Row("answer, p99", percentile(ours, 99) * 1e3, percentile(bare, 99) * 1e3, "ms", SAME_SERVER),
        Row("answer, p99", percentile(ours, 99) * 1e3, LIMIT, "ms", "limit"),
        Row("requests/s, 4 kept connections", ours_most, bare_most, "1/s", SAME_SERVER),
        Row("real-time factor meanwhile", factor, 1.0, "", "the clock"),
    ]


def under_load(address: str, with_pictures: bool) -> list[float]:
    """Seconds from each request's turn to the end of its answer."""
    delays: list[float] = []
    failures: list[BaseException] = []
    begin = time.monotonic() + 0.5

    def ask(client: int) -> None:
        connection = http.client.HTTPConnection(address, timeout=5.0)
        try:
            for number in range(client, int(RATE * SECONDS), CLIENTS):
                turn = begin + number / RATE
                time.sleep(max(0.0, turn - time.monotonic()))
                picture = with_pictures and number % PICTURE_EVERY == 0
                request = PICTURE if picture else REQUESTS[(number // CLIENTS) % len(REQUESTS)]
                exchange(connection, request)
                delays.append(time.monotonic() - turn)
                if client % 2:
                    connection.close()
        except (OSError, RuntimeError, http.client.HTTPException) as error:
            failures.append(error)
        finally:
            connection.close()

    if with_pictures:
        exchange(http.client.HTTPConnection(address, timeout=5.0), PICTURE)  # the camera takes a moment to wake
    run_all(ask, CLIENTS)
    if failures:
        raise RuntimeError(f"{len(failures)} clients gave up: {failures[0]!r}")
    return delays


def full_speed(address: str) -> float:
    """Requests per second over four kept connections, as fast as they are answered."""
    counts = []

    def ask(_client: int) -> None:
        connection = http.client.HTTPConnection(address, timeout=5.0)
        end, count = time.monotonic() + FULL_SPEED, 0
        for request in cycle(REQUESTS):
            if time.monotonic() > end:
                break
            exchange(connection, request)
            count += 1
        connection.close()
        counts.append(count)

    run_all(ask, 4)
    return sum(counts) / FULL_SPEED


def run_all(work, count: int) -> None:
    threads = [threading.Thread(target=work, args=(number,)) for number in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def exchange(connection: http.client.HTTPConnection, request: tuple[str, str, bytes | None]) -> bytes:
    connection.request(*request)
    answer = connection.getresponse()
    body = answer.read()
    if answer.status != 200:
        raise RuntimeError(f"{request[:2]} answered {answer.status}: {body[:80]!r}")
    return body


def odometry(address: str) -> int:
    """The count of readings."""
    connection = http.client.HTTPConnection(address, timeout=5.0)
    try:
        return json.loads(exchange(connection, ("GET", "/data/odometry", None)))[6]
    finally:
        connection.close()


@contextmanager
def server(*arguments: str) -> Iterator[str]:
    """host:port of a server program that prints its URL."""
    process = processes.start(
        [sys.executable, *arguments],
        cwd=Path(__file__).resolve().parents[2],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        for line in process.stdout:
            if "http://" in line:
                yield line.split("http://")[1].strip().strip("/")
                return
        raise RuntimeError(f"{arguments} did not start")
    finally:
        processes.end(process)
        process.stdout.close()


def serve_constant() -> None:
    """What the reference answers: as long as a reading, always the same."""
    body = b"[0.41,0.41,0.41,0.41,0.41,0.41,0.41,0.41,0.41]"
    headers = [("Content-Type", "application/json"), ("Content-Length", str(len(body)))]

    def application(environ, start_response):
        environ["wsgi.input"].read()
        start_response("200 OK", headers)
        return [body]

    with WebServer(application) as constant:
        print(constant.url, flush=True)
        threading.Event().wait()


if __name__ == "__main__":
    serve_constant()
