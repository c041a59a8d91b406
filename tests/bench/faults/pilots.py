"""Who drives: a program on a topic, a key in a terminal, a key in the window. Each holds and lets go."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Protocol

from telepresence.station import processes

from .station import Robot, Station

FIRST_REPEAT, REPEAT = 0.5, 0.04
"""Seconds to the first and between the next repeats of a held key, as X servers and consoles do it."""

FASTER = "+" * 7
"""Robotino's keyboard begins with 0.05 m/s; from here on the gate limits it."""

TABS = {"pepper": ("50", "27"), "robotino": ("125", "27")}
"""In the window of both [pixel]."""


class Pilot(Protocol):
    """Somebody with a finger on a key."""

    def approach(self) -> None:
        """Get to where this robot is driven from."""

    def hold(self) -> None:
        """Press forward and keep it."""

    def release(self) -> None:
        """Let go."""

    def close(self) -> None:
        """Let go and leave."""


class TopicPilot:
    """`pilot_node.py`: velocities 20 times a second.

    Args:
        speed: [m/s]
        command: Words in front of the program, such as those that enter a namespace.
    """

    def __init__(self, environment: dict[str, str], topic: str, speed: float, command: tuple[str, ...] = ()) -> None:
        program = Path(__file__).with_name("pilot_node.py")
        self._speed = speed
        self.process = processes.start(
            [*command, sys.executable, str(program), topic], env=environment, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        if self.process.stdout.readline() != "ready\n":
            raise RuntimeError("the pilot's program did not start")

    def approach(self) -> None:
        """Its topic is always there."""

    def hold(self) -> None:
        self.drive(self._speed, 0.0)

    def drive(self, vx: float, wz: float) -> None:
        """Hold this velocity [m/s, rad/s]."""
        self._ask(f"hold {vx} {wz}")

    def release(self) -> None:
        self._ask("release")

    def restart_world(self) -> str:
        """Bring the simulated world back to its start; why that failed, or ""."""
        self._ask("restart")
        answer = self.process.stdout.readline().strip()
        return "" if answer == "done" else answer or "the pilot's program has ended"

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.stdin.close()
        processes.end(self.process)
        self.process.stdout.close()

    def _ask(self, line: str) -> None:
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()


class TerminalPilot:
    """A key in the terminal that the station was started in, which repeats it while it is held. Pepper's keyboard, as
    the original, goes on with a key until the next one: there the key that stops is pressed at the release."""

    def __init__(self, station: Station, robot: Robot) -> None:
        assert station.terminal is not None
        self._terminal = station.terminal
        self._key = "i" if robot.name == "pepper" else "w"
        self._stop = "k" if robot.name == "pepper" else ""
        self._faster = "" if robot.name == "pepper" else FASTER
        self._released: threading.Event | None = None
        self._thread: threading.Thread | None = None

    def approach(self) -> None:
        """Its keyboard program has the terminal."""

    def hold(self) -> None:
        if self._released is None:
            self._released = threading.Event()
            self._terminal.type(self._faster)
            self._thread = threading.Thread(target=self._type, args=(self._released,), name="key", daemon=True)
            self._thread.start()

    def release(self) -> None:
        if self._released is not None and self._thread is not None:
            self._released.set()
            self._thread.join()
            self._released = None
            self._terminal.type(self._stop)

    def close(self) -> None:
        self.release()

    def _type(self, released: threading.Event) -> None:
        wait = FIRST_REPEAT
        while True:
            self._terminal.type(self._key)
            if released.wait(wait):
                return
            wait = REPEAT


class WindowPilot:
    """The key W in the operator's window, on the page of this robot: a window that comes back shows it by itself."""

    def __init__(self, station: Station, robot: Robot) -> None:
        self._station = station
        several = len(station.robots) > 1
        self._nowhere = ("4", "400") if several else ("60", "84")
        self._tab = ("mousemove", *TABS[robot.name], "click", "1", "sleep", "0.3") if several else ()
        self._display: dict[str, str] = {}

    def approach(self) -> None:
        if self._tab:
            self._do(*self._tab)

    def hold(self) -> None:
        # A click on a place that does nothing else gives the keyboard to a window that has come back.
        self._do("mousemove", *self._nowhere, "click", "1", "keydown", "w")

    def release(self) -> None:
        self._do("keyup", "w")

    def close(self) -> None:
        self.release()

    def _do(self, *words: str) -> None:
        """A display that has been killed takes no keys: then nothing is held either. Which one it is, is asked only
        when the one that was known takes none: that takes time, which would count as the robot's."""
        if not (self._display and self._press(*words)):
            try:
                self._display = self._station.display
            except (RuntimeError, OSError):
                self._display = {}
                return
            self._press(*words)

    def _press(self, *words: str) -> bool:
        environment = {**os.environ, **self._display}
        pressed = subprocess.run(["xdotool", *words], env=environment, capture_output=True, timeout=10.0, check=False)
        return pressed.returncode == 0
