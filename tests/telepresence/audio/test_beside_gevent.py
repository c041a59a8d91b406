"""GStreamer and gevent in one program, as in a world with a Pepper that is heard and a Robotino's web server."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import {first}
import {second}
from telepresence.audio.pipeline import Gst
from telepresence.web.server import WebServer
for _ in range(5):
    with WebServer(lambda environment, start: start("200 OK", []) and []):
        pass
"""


@pytest.mark.parametrize("order", [("numpy", "telepresence.audio.pipeline"), ("telepresence.audio.pipeline", "numpy")])
def test_web_servers_end_in_a_program_that_plays_sound(order: tuple[str, str]) -> None:
    program = PROGRAM.format(first=order[0], second=order[1])
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
