"""What happens to the station: somebody drives, watches, talks; programs die, the link is cut."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Sequence

from soak.samples import program_name
from soak.schedule import Event
from soak.station import Station, command
from telepresence.station import processes

KEYS = ("w", "s", "a", "d", "q", "e")
TERMINAL_KEYS = ("i", "j", "l", "comma")
PICTURE = (380, 160)
"""A point in the window's picture above the horizon [px]: a click gives the pad the keyboard and drives nowhere."""
TURN = "{linear: {x: 0.1}, angular: {z: 0.5}}"
RESTARTED = {
    "telepresence_ros.core", "telepresence_ros.roslaunch", "telepresence.station.screen_page", "Xvfb",
    "pepper_sim", "robotino_sim", "drive_server.py",
    "robotino_onboard drive", "robotino_onboard camera", "robotino_onboard sound",
}  # fmt: skip
"""Programs without a node's name that somebody restarts; nodes are restarted all."""
STARTS_WITHIN = 1.5
"""[s] that rostopic takes until it publishes."""
RETURNS_WITHIN = 30.0
"""[s]; a program that is away for longer is reported."""
READER = """
import sys, time, urllib.request
with urllib.request.urlopen(sys.argv[1], timeout=20.0) as stream:
    if sys.argv[2] == "stalled":
        time.sleep(600.0)
    while stream.read(65536):
        pass
"""
"""Reads a web page's stream, or opens it and reads nothing."""


class Activities:
    """Carries out events. Args: note: Called with what happened, for the record."""

    def __init__(self, station: Station, note: Callable[[str, str], None]) -> None:
        self._station, self._note = station, note
        self._count = 0
        self._away: dict[str, float] = {}  # name of a killed program -> when
        self._joined_at: float | None = None
        self._pressed: list[tuple[float, Callable[[], None]]] = []

    def do(self, event: Event) -> None:
        """Begin an event; `release` ends it."""
        if event.kind == "phase":
            self._note("phase", event.what)
        else:
            getattr(self, f"_{event.kind}")(event)

    @property
    def waits(self) -> bool:
        """Whether a program that was killed is not back yet."""
        return bool(self._away)

    def release(self) -> None:
        """Release keys and join the link again, when their time is over."""
        now = time.monotonic()
        if self._joined_at is not None and now > self._joined_at:
            self._station.network.cut, self._joined_at = False, None
            self._note("link", "joined")
        for due in [each for each in self._pressed if now > each[0]]:
            self._pressed.remove(due)
            due[1]()

    def look_after(self, names: Collection[str]) -> None:
        """Note which of the killed programs are back among those that run."""
        now = time.monotonic()
        for name, since in [*self._away.items()]:
            if name in names:
                del self._away[name]
                self._note("back", f"{name} after {now - since:.1f} s")
            elif now - since > RETURNS_WITHIN:
                del self._away[name]
                self._note("not back", f"{name} within {RETURNS_WITHIN:.0f} s")

    def _drive(self, event: Event) -> None:
        self._count += 1
        if event.what == "topic":
            topic = ("/cmd_vel", "/rto3/safe_cmd_vel")[self._count % 2]
            argv = ["rostopic", "pub", "-r", "10", topic, "geometry_msgs/Twist", TURN]
            self._station.passing("pilot", STARTS_WITHIN + event.seconds, *argv)
        elif event.what == "window":
            key = KEYS[self._count % len(KEYS)]
            self._input("mousemove", *PICTURE, "click", 1, "keydown", key)
            self._pressed.append((time.monotonic() + event.seconds, lambda: self._input("keyup", key)))
        else:
            terminals = self._input("search", "--class", "XTerm").split()
            if terminals:
                place = ("mousemove", "--window", terminals[-1], 60, 60, "click", 1)
                self._input(*place, "key", TERMINAL_KEYS[self._count % len(TERMINAL_KEYS)])
                self._pressed.append((time.monotonic() + event.seconds, lambda: self._input(*place, "key", "k")))

    def _viewer(self, event: Event) -> None:
        self._note("viewer", event.what)
        if event.what in ("page", "stalled page"):
            url = f"{self._station.page_url}/video_feed?k={self._station.environment['TELEPRESENCE_PAGE_KEY']}"
            argv = [sys.executable, "-c", READER, url, event.what.partition(" ")[0]]
            self._station.passing("robot", event.seconds, *argv)
        elif event.what == "camera":
            self._count += 1
            receiver = ("rosrun", "rto_node", "rto_camera_receiver", f"__name:=soak_receiver_{self._count}")
            sender = f"_sender:={self._station.robot.address}:8083"
            self._station.passing("pilot", event.seconds, *receiver, "__ns:=/soak", sender)
            self._station.passing("pilot", event.seconds, "rostopic", "hz", "/soak/img_raw")
        else:
            window = (sys.executable, "-m", "gui", "--profile", "both", "--no-sign-in", "--gamepad", "none")
            display = (sys.executable, "-m", "telepresence.station.virtual_display", "1280x720")
            self._station.passing("pilot", event.seconds, *display, *window)

    def _say(self, event: Event) -> None:
        argv = ["rostopic", "pub", "-1", "/speech", "std_msgs/String", f"data: {event.what}"]
        self._station.passing("pilot", 10.0, *argv)

    def _cut(self, event: Event) -> None:
        self._station.network.cut = True
        self._joined_at = time.monotonic() + event.seconds
        self._note("link", f"cut for {event.seconds:.1f} s")

    def _kill(self, event: Event) -> None:
        """Kill the program that the event's number between 0 and 1 picks from the sorted list of names."""
        pids: dict[str, list[int]] = {}
        for pid in self._station.pids():
            words = command(pid)
            if words and words[0] and killable(words):
                pids.setdefault(program_name(words), []).append(pid)
        names = sorted(pids)
        name = names[int(float(event.what) * len(names))]
        self._note("kill", name)
        for pid in pids[name]:
            processes.send(pid, signal.SIGKILL)
        self._away[name] = time.monotonic()

    def _input(self, *words: object) -> str:
        """Keyboard and mouse: xdotool, on the pilot's machine. Elsewhere another display has this one's number."""
        display = self._station.display
        if not display:
            self._note("no window", " ".join(map(str, words)))
            return ""
        done = subprocess.run(
            self._station.pilot.command("xdotool", *map(str, words)),
            env={**self._station.environment, **display},
            capture_output=True,
            text=True,
            timeout=20.0,
        )
        if done.returncode:
            self._note("input failed", done.stderr.strip()[:200])
        return done.stdout


def killable(words: Sequence[str]) -> bool:
    """Whether somebody is there to restart the program with this command line."""
    return any(word.startswith("__log:=") for word in words) or program_name(words) in RESTARTED
