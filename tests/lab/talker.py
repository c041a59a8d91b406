"""Programs in processes of their own that a test commands: a line of JSON over standard input, a line as the answer."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import forked_programs

from telepresence.station import processes

LAB = Path(__file__).resolve().parent
PROBE = LAB.parent / "catkin_ws" / "ros_probe.py"
REMOTE_WINDOW = LAB.parent / "gui" / "remote_window.py"
FAULTY_PEPPER = LAB / "faulty_pepper.py"


class Talker:
    """A Python program, until `close`."""

    def __init__(self, environment: dict[str, str], *argv: object) -> None:
        self._name = str(argv[0])
        self.process = forked_programs.start(
            [sys.executable, *map(str, argv)], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, *words: object) -> Any:
        """Send the words; return the answer."""
        self.process.stdin.write(json.dumps(words) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        while answer.startswith("[INFO]"):  # rospy says such things there, too
            answer = self.process.stdout.readline()
        assert answer, f"{self._name} died while it was asked for {words}"
        return json.loads(answer)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.stdin.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(5.0)
        processes.end(self.process, patience=5.0)


class Caller(Talker):
    """A program that is asked for [method, arguments]: its methods are ours."""

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments: self.ask(name, arguments)
