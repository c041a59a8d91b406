"""`python -m pepper_sim` as a program: its address, its end, its errors."""

import logging
import re
import signal
import socket
import subprocess
import sys
import time

import pytest

from pepper_sim.__main__ import main

pytestmark = pytest.mark.slow

COMMAND = (sys.executable, "-m", "pepper_sim", "--scene", "empty")


@pytest.fixture
def run_here(monkeypatch, capsys):
    """Run the program's main function in this process: (exit status, standard output, standard error)."""
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr(logging, "basicConfig", lambda **_: None)

    def run(*arguments):
        try:
            status = main(["--scene", "empty", *arguments])
        except SystemExit as ended:
            status = ended.code
        return status, *capsys.readouterr()

    return run


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_it_tells_its_address_serves_and_ends(qi, run_program, number):
    program = run_program(*COMMAND, "--port", "0", stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    line = program.stdout.readline()
    url = re.fullmatch(r"listening on (tcp://127\.0\.0\.1:\d+)\n", line).group(1)
    client = qi.Session()
    client.connect(url)
    motion, video = client.service("ALMotion"), client.service("ALVideoDevice")
    motion.moveTo(1.0, 0.0, 0.0, _async=True)
    handle = video.subscribeCamera("x", 0, 1, 11, 10)
    assert video.getImageRemote(handle) is not None
    begin = time.monotonic()
    program.send_signal(number)
    assert program.wait(timeout=20) == 0
    assert time.monotonic() - begin < 5.0
    client.close()
    assert "Traceback" not in program.stderr.read()


def test_a_taken_port_and_other_mistakes_are_reported_in_one_line(run_here):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        status, out, err = run_here("--port", str(taken.getsockname()[1]))
    assert status == 1 and "Address already in use" in err and "Traceback" not in err and out == ""
    status, _, err = run_here("--scene", "moon", "--port", "0")
    assert status == 1 and "apartment" in err
    status, _, err = run_here("--address", "203.0.113.9", "--port", "0")
    assert status == 1 and "cannot listen on tcp://203.0.113.9:0" in err
    assert run_here("--port", "70000")[0] == 2 and run_here("--port", "many")[0] == 2


def test_the_viewer_needs_a_display(run_here, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    status, _, err = run_here("--viewer", "--port", "0")
    assert status == 1 and "display" in err and "Traceback" not in err


def test_help_names_every_option(run_here):
    status, out, _ = run_here("--help")
    assert status == 0
    for option in ("--port", "--address", "--scene", "--seed", "--viewer"):
        assert option in out


def test_listening_for_everybody_is_warned_about(run_program):
    program = run_program(
        *COMMAND, "--port", "0", "--address", "0.0.0.0", stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert program.stdout.readline().startswith("listening on tcp://")
    program.send_signal(signal.SIGTERM)
    assert program.wait(timeout=20) == 0
    assert "without authentication" in program.stderr.read()
