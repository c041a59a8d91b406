"""The quick end of many programs."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Sequence

from telepresence.station import processes


def end_together(started: Sequence[subprocess.Popen], patience: float = 15.0) -> None:
    """End programs and all that they have started, everything at the same time: roslaunch alone would end its nodes one
    after the other. Who does not end within `patience` seconds is killed."""
    family = [pid for process in started for pid in processes.descendants(process.pid)]
    for process in started:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)  # before its nodes, which roslaunch would start again
    for pid in family:
        processes.send(pid, signal.SIGINT)
    deadline = time.monotonic() + patience
    for process in started:
        try:
            process.wait(max(0.1, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    while {*family} & {*processes.descendants()}:
        if time.monotonic() > deadline:
            for pid in family:
                processes.send(pid, signal.SIGKILL)
        time.sleep(0.02)
