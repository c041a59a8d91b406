"""The operator's window on a virtual display: keyboard and mouse input, screenshots, a robot to drive."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from repeated_presses import press_until

from gui.terminal.tmux import SESSION, Tmux
from telepresence.station import processes
from telepresence.station.virtual_display import VirtualDisplay, grab

EMPTY = 8000
"""Bytes; a picture of nothing is smaller."""


class Screen:
    """A virtual display with a keyboard and a mouse, and the window that runs on it."""

    def __init__(self, display: VirtualDisplay, run_program: Callable, wait_until: Callable) -> None:
        self.environment = {**os.environ, **display.environment, "PYTHONFAULTHANDLER": "1"}
        self._folder = display.folder
        self._windows: list[Window] = []
        self._held: set[tuple[str, str]] = set()
        self._run_program, self._wait_until = run_program, wait_until

    def open_window(
        self,
        *arguments: str,
        program: tuple[str, ...] = (sys.executable, "-m", "gui", "--no-sign-in"),
        signed_in: bool = True,
    ) -> Window:
        process = self._run_program(
            *program, *arguments, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        window = Window(process, self, self._wait_until, signed_in)
        self._windows.append(window)
        return window

    def close(self) -> None:
        """End the windows and wait until all that ran in their terminals has ended, too."""
        for window in self._windows:
            family = window.family()
            processes.end(window.process, patience=10.0)
            self._wait_until(
                lambda family=family: not {*family} & {*processes.descendants()}, "the programs have ended"
            )

    def colour(self, x: int, y: int) -> tuple[int, int, int]:
        """Eyes: red, green and blue of a point."""
        blue, green, red = grab(self._folder)[y, x]
        return int(red), int(green), int(blue)

    def photograph(self, target: Path, window: str = "root") -> None:
        """What is on the screen, or in a window of that id, when there is something."""

        def shown() -> bool:
            subprocess.run(["import", "-window", window, str(target)], env=self.environment, check=True, timeout=20)
            return target.stat().st_size > EMPTY

        self._wait_until(shown, f"there is something to see: {target.stem}")

    def do(self, *words: object) -> str:
        """Hands: xdotool."""
        self._note_held([str(word) for word in words])
        done = subprocess.run(
            ["xdotool", *map(str, words)], env=self.environment, capture_output=True, text=True, timeout=20
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def hold(self, key: str, seconds: float) -> tuple[float, float]:
        """When the key went down and up [s since 1970]."""
        clock = ("exec", "--sync", "--args", 2, "date", "+%s.%N")
        told = self.do(*clock, "keydown", key, "sleep", seconds, *clock, "keyup", key)
        pressed, released = map(float, told.split())
        return pressed, released

    def let_go(self) -> None:
        """Release every key and button that is still held: a test that failed must not drive into the next one."""
        for release, what in sorted(self._held):
            self.do(release, what)

    def evidence(self) -> str:
        """Return what is on the screen, as a file, who has the keyboard, and what the windows showed the pilot."""
        shot = tempfile.NamedTemporaryFile(prefix="screen-", suffix=".png", delete=False)
        subprocess.run(["import", "-window", "root", shot.name], env=self.environment, timeout=20)
        asked = {
            "keyboard": ("getwindowfocus", "-f", "getwindowname"),
            "visible": ("search", "--onlyvisible", "--name", ".", "getwindowname", "%@"),
            "pointer": ("getmouselocation",),
        }
        found = (f"{what}: {', '.join(self._ask(*words).splitlines())}" for what, words in asked.items())
        told = ("\n".join(window.output.splitlines()[-40:]) for window in self._windows)
        return "\n".join((f"picture: {shot.name}", *found, *told))

    def _ask(self, *words: str) -> str:
        """What xdotool says; nothing where there is no such window."""
        return subprocess.run(
            ["xdotool", *words], env=self.environment, capture_output=True, text=True, timeout=20
        ).stdout

    def _note_held(self, words: list[str]) -> None:
        for word, what in itertools.pairwise(words):
            if word in ("keydown", "mousedown"):
                self._held.add((word.replace("down", "up"), what))
            elif word in ("keyup", "mouseup"):
                self._held.discard((word, what))


class Window:
    """The operator's window as a process of its own."""

    def __init__(self, process: subprocess.Popen, screen: Screen, wait_until: Callable, signed_in: bool) -> None:
        self.process, self.screen, self._wait_until = process, screen, wait_until
        self.tmux = Tmux(f"telepresence-{process.pid}")
        self.output = ""
        threading.Thread(target=self._read, name="window-output", daemon=True).start()
        self.id = wait_until(self._find, "the window is on the screen")
        if not signed_in:
            return
        wait_until(lambda: "$" in self.terminal_text(), "the terminal shows a prompt")

    def enter_terminal(self) -> None:
        """Give the keyboard to the terminal by F6, if it does not have it."""
        deadline = time.monotonic() + 20.0
        while not self.terminal_has_keyboard():
            assert time.monotonic() < deadline, "F6 does not give the terminal the keyboard"
            self.type("F6")
            ends = time.monotonic() + 2.0
            while time.monotonic() < ends and not self.terminal_has_keyboard():
                time.sleep(0.02)

    def terminal_text(self, window: str = "session") -> str:
        try:
            return self.tmux.text(window)
        except RuntimeError:
            return ""

    def terminal_has_keyboard(self) -> bool:
        """Whether the X server sends keys to a window inside ours; 0 and 1 stand for none and for the pointer's."""
        return self.screen.do("getwindowfocus", "-f") not in ("0", "1", self.id)

    def terminal_size(self) -> str:
        return self.tmux._call("display-message", "-p", "-t", SESSION, "#{window_width}x#{window_height}")

    def family(self) -> list[int]:
        """Processes of this window: its descendants, and those of tmux, which leaves the family."""
        name = f"telepresence-{self.process.pid}"
        roots = [self.process.pid, *(pid for pid in processes.descendants() if name in _command(pid))]
        return sorted({*roots, *(pid for root in roots for pid in processes.descendants(root))})

    def click(self, point: tuple[int, int]) -> None:
        self.screen.do("mousemove", *point, "click", 1)

    def type(self, *keys: str) -> None:
        self.screen.do("key", *keys)

    def type_until(self, key: str, condition: Callable[[], object], what: str) -> None:
        """Press a key until something is so. The keyboard in the terminal lets go of a key, as it must, when it is not
        run for half a second, as on a busy machine: then the key is pressed again."""
        press_until(lambda: self.type(key), lambda: None, self._wait_until, condition, what)

    def _read(self) -> None:
        for line in self.process.stdout:
            self.output += line

    def _find(self) -> str | None:
        if self.process.poll() is not None:
            pytest.fail(f"the window ended: {self.output}")
        found = subprocess.run(
            ["xdotool", "search", "--onlyvisible", "--name", "^Telepresence"],
            env=self.screen.environment, capture_output=True, text=True, timeout=20,
        )  # fmt: skip
        return found.stdout.split("\n")[0]


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""


FAKE_ROBOT = textwrap.dedent("""
    import sys, time, numpy as np, rospy
    from geometry_msgs.msg import Twist
    from sensor_msgs.msg import Image
    from telepresence.video.images import fill_image_message
    from telepresence_ros.master_watch import MasterWatch
    rospy.init_node("fake_robot")
    images = rospy.Publisher("/pepper_robot/camera/front/image_raw", Image, queue_size=1)
    def hear(twist):
        fields = time.monotonic(), twist.linear.x, twist.linear.y, twist.angular.z
        print(" ".join(map(str, fields)) + "\\n", end="", flush=True)  # in one piece: each publisher has a thread
    rospy.Subscriber("cmd_vel", Twist, hear, tcp_nodelay=True)
    MasterWatch().start()
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:, :32], pixels[:, 32:] = (250, 30, 20), (20, 30, 250)
    print("ready", flush=True)
    while not rospy.is_shutdown():
        images.publish(fill_image_message(Image(), pixels, "rgb8"))
        time.sleep(0.05)
""")


class FakeRobot:
    """Publishes a picture, left half red, right half blue, and receives cmd_vel: (time [s], vx, vy, wz)."""

    def __init__(self, run_program: Callable) -> None:
        self.heard: list[tuple[float, ...]] = []
        self.process = run_program(sys.executable, "-c", FAKE_ROBOT, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"
        threading.Thread(target=self._read, name="robot-ear", daemon=True).start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self.heard.append(tuple(map(float, line.split())))

    def velocity(self) -> tuple[float, ...] | None:
        """The last command: vx, vy [m/s], wz [rad/s]."""
        return self.heard[-1][1:] if self.heard else None
