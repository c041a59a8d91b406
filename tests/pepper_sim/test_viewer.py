"""MuJoCo's viewer beside a simulated Pepper, on a real X server."""

import os
import signal
import subprocess
import sys

import pytest

pytestmark = pytest.mark.x11


def test_the_viewer_opens_and_the_robot_answers(qi, run_program):
    read_end, write_end = os.pipe()
    run_program(
        "Xvfb", "-displayfd", str(write_end), "-nolisten", "tcp", pass_fds=(write_end,), stderr=subprocess.DEVNULL
    )
    os.close(write_end)
    with os.fdopen(read_end) as numbers:
        display = f":{numbers.readline().strip()}"
    program = run_program(
        *(sys.executable, "-m", "pepper_sim", "--scene", "empty", "--port", "0", "--viewer"),
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "DISPLAY": display},
    )
    client = qi.Session()
    client.connect(program.stdout.readline().split()[-1])
    assert client.service("ALMotion").moveTo(0.05, 0.0, 0.0) is True
    client.close()
    program.send_signal(signal.SIGTERM)
    assert program.wait(timeout=20) == 0
