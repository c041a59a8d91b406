"""A signal that comes at the worst moment: while the main thread is inside `stop.wait()` and holds the event's lock."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import os, runpy, signal, sys, threading

wait = threading.Event.wait

def interrupted(event, timeout=None):
    caller = sys._getframe(1)
    if threading.current_thread() is threading.main_thread() and caller.f_globals.get("__name__") in WAITING:
        with event._cond:  # as wait() does for a moment
            os.kill(os.getpid(), signal.SIGINT)
            for _ in range(1000):
                pass  # the handler runs here
        assert wait(event, 10.0)
        return True
    return wait(event, timeout)

threading.Event.wait = interrupted
sys.argv[0] = "program"
"""


@pytest.mark.parametrize(
    ("waiting", "run"),
    [
        ("__main__", "from telepresence_ros.node import stop_on_signals; stop_on_signals(threading.Event()).wait()"),
        ("__main__", "runpy.run_module('telepresence.station.screen_page', run_name='__main__')"),
        ("telepresence.sim.command_line", "runpy.run_module('robotino_sim', run_name='__main__')"),
    ],
    ids=["node", "screen page", "simulator"],
)
def test_a_signal_inside_the_wait_for_it_ends_the_program(waiting, run, tmp_path):
    options = {"__main__": [str(tmp_path), "--port=0"]}.get(waiting, ["--port=0", "--scene=empty"])
    source = PROGRAM.replace("WAITING", repr((waiting,))) + run
    done = subprocess.run(
        [sys.executable, "-c", source, *options], cwd=ROOT, capture_output=True, text=True, timeout=60
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("before", "ended"), [([], True), (["nohup"], False)], ids=["terminal", "nohup"])
def test_a_closed_terminal_ends_a_program_unless_it_was_started_to_outlive_it(before, ended):
    source = (
        "import os, signal, threading; from telepresence.stop_signals import stop_on; stop = threading.Event();"
        "stop_on(stop, signal.SIGHUP, signal.SIGINT); os.kill(os.getpid(), signal.SIGHUP); print(stop.wait(0.3))"
    )
    words = ["env", "--default-signal=HUP", *before, sys.executable, "-c", source]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == str(ended), done.stderr
