"""A signal that comes at the worst moment: while the main thread is inside `stop.wait()` and holds the event's lock."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import os, signal, threading
from telepresence_ros.node import stop_on_signals
stop = stop_on_signals(threading.Event())
with stop._cond:  # as Event.wait() does for a moment
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(1000):
        pass  # the handler runs here
assert stop.wait(10.0)
print("stopped")
"""


def test_a_signal_inside_the_wait_for_it_ends_the_node() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60)
    assert done.stdout == "stopped\n", done.stderr
