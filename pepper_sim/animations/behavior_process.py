"""A behaviour with scripts runs in a process of its own, as a program on the robot that talks to NAOqi."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from pepper_sim.naoqi.service_programs import environment

log = logging.getLogger(__name__)

KILL_AFTER = 3.0
"""Seconds between SIGTERM and SIGKILL when a behaviour is stopped."""
_LONGEST_ERROR = 300


class BehaviorProcess:
    """One run of a behaviour in a process.

    Args:
        file: Its behavior.xar.
        behavior: Its name, "package/path".
        url: Where NAOqi answers.
        ended: Called once, on a thread of its own: name of the box and text of the error, both "" without one.
    """

    def __init__(self, file: Path, behavior: str, url: str, ended: Callable[[str, str], None]) -> None:
        self._ended = ended
        self._stopped = False
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "pepper_sim.animations.behavior_program", str(file), behavior],
            cwd=file.parent,
            env=environment(url),
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        threading.Thread(target=self._watch, args=(behavior,), name=behavior, daemon=True).start()

    def stop(self) -> None:
        """End it; returns at once."""
        self._stopped = True
        if self._process.poll() is not None:
            return
        self._process.terminate()
        timer = threading.Timer(KILL_AFTER, self._process.kill)
        timer.daemon = True
        timer.start()

    def _watch(self, behavior: str) -> None:
        """Log what it writes on its standard error; the last line names the box and the error if it failed."""
        last = ""
        assert self._process.stderr is not None
        with self._process.stderr as lines:
            for line in lines:
                last = line.decode(errors="replace").strip()
                log.info("%s: %s", behavior, last)
        code = self._process.wait()
        if code == 0 or self._stopped:
            self._ended("", "")
        else:
            box, _, error = last.partition(": ")
            self._ended(box[:_LONGEST_ERROR], error[:_LONGEST_ERROR] or f"it ended with {code}")
