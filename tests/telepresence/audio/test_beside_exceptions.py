"""GStreamer in one program with libraries that throw C++ exceptions: gevent's greenlets and libqi."""

from __future__ import annotations

import subprocess
import sys

import pytest

WEB = """
from telepresence.web.server import WebServer
for _ in range(5):
    with WebServer(lambda environment, start: start("200 OK", []) and []):
        pass
"""
ROBOT = """
import contextlib
import qi
class Service:
    def fail(self):
        raise ValueError("no")
robot = qi.Session()
robot.listenStandalone("tcp://127.0.0.1:0")
robot.registerService("Service", Service())
for _ in range(3):
    pilot = qi.Session()
    pilot.connect(robot.endpoints()[0])
    with contextlib.suppress(RuntimeError):
        pilot.service("Service").fail()
    pilot.close()
"""
SOUND = "telepresence.audio.pipeline"


@pytest.mark.parametrize("program", [WEB, ROBOT], ids=["web servers end", "a pilot leaves"])
@pytest.mark.parametrize("first", [("numpy", SOUND), (SOUND, "numpy")], ids=["NumPy first", "sound first"])
def test_a_program_that_plays_sound_survives_when(program: str, first: tuple[str, str]) -> None:
    program = "".join(f"import {name}\n" for name in first) + program
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
