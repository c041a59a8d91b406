"""The program as users start it."""

import signal
import subprocess
import sys
import time
import urllib.request

import pytest

PROGRAM = (sys.executable, "-m", "robotino_sim")


def url_of(process):
    line = process.stdout.readline()
    assert line.startswith("listening on http://127.0.0.1:")
    return line.split()[-1]


@pytest.mark.parametrize("request_to_end", [signal.SIGINT, signal.SIGTERM])
def test_says_where_it_listens_and_ends_when_told(run_program, request_to_end):
    process = run_program(*PROGRAM, "--port", "0", "--scene", "empty", stdout=subprocess.PIPE, text=True)
    url = url_of(process)
    assert urllib.request.urlopen(url + "/cam0", timeout=10.0).status == 200
    begin = time.monotonic()
    process.send_signal(request_to_end)
    assert process.wait(timeout=10.0) == 0
    assert time.monotonic() - begin < 10.0
    assert process.stdout.read() == ""


def test_a_taken_port_is_named(run_program):
    first = run_program(*PROGRAM, "--port", "0", "--scene", "empty", stdout=subprocess.PIPE, text=True)
    port = url_of(first).rpartition(":")[2]
    second = subprocess.run([*PROGRAM, "--port", port], capture_output=True, text=True, timeout=30.0)
    assert second.returncode == 1
    assert f"port {port}" in second.stderr and "Traceback" not in second.stderr


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (("--terrain", "moon"), "arena"),
        (("--port", "99999"), "65535"),
        (("--address", "203.0.113.7"), "203.0.113.7"),
        (("--watchdog", "7"), "0.2"),
    ],
)
def test_mistakes_are_explained(arguments, hint):
    found = subprocess.run([*PROGRAM, "--port", "0", *arguments], capture_output=True, text=True, timeout=30.0)
    assert found.returncode != 0
    assert hint in found.stderr and "Traceback" not in found.stderr


def test_listening_to_everybody_is_warned_about(run_program):
    process = run_program(
        *(*PROGRAM, "--port", "0", "--scene", "empty", "--address", "0.0.0.0"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline().startswith("listening on http://0.0.0.0:")
    process.send_signal(signal.SIGTERM)
    assert "without authentication" in process.communicate(timeout=10.0)[1]
