"""Scripted people who drive by the page: by held keys, by one switch, and by gaze.

They see where the robot is (the truth takes the place of the picture) and where things are on the page. They decide as
people do who are careful: turn when the way is off, go on when it is not.
"""

from __future__ import annotations

import math
import random
import time
from collections import deque
from collections.abc import Callable
from typing import ClassVar, Protocol

from page_in_process import PageBrowser

Pose = tuple[float, float, float]
"""x, y, heading in the room [m, m, rad]."""
TURN = math.radians(15.0)
"""What a step turns."""
THERE = 0.25
"""[m] from a place that count as there."""
EYE_DISTANCE = 0.6
"""[m] between eyes and screen."""
PIXEL = 0.0254 / 96
"""[m] of a CSS pixel."""


def choose(pose: Pose, goal: tuple[float, float]) -> str:
    """Return the arrow that brings the robot nearer to a place; "" there."""
    x, y = goal[0] - pose[0], goal[1] - pose[1]
    if math.hypot(x, y) < THERE:
        return ""
    off = math.remainder(math.atan2(y, x) - pose[2], math.tau)
    if abs(off) > 0.6 * TURN:
        return "turn_left" if off > 0 else "turn_right"
    return "forward"


class User(Protocol):
    """Somebody who drives by the page."""

    def press(self, arrow: str) -> None:
        """Let the robot do what an arrow says, for a moment or for a step."""

    def rest(self) -> None:
        """Press nothing any more."""


def drive(pose: Callable[[], Pose], way: list[tuple[float, float]], user: User, limit: float) -> float:
    """Drive along a way; return the seconds it took. AssertionError after `limit` seconds."""
    began = time.monotonic()
    for goal in way:
        while arrow := choose(pose(), goal):
            assert time.monotonic() - began < limit, f"not at {goal} after {limit:.0f} s, but at {pose()}"
            user.press(arrow)
    user.rest()
    return time.monotonic() - began


def _driving(browser: PageBrowser) -> bool:
    return bool(browser.evaluate("document.querySelector('[data-drive].acting') !== null"))


class KeyUser:
    """Holds keys: what the others are compared with."""

    KEYS: ClassVar = {"forward": "KeyW", "turn_left": "KeyQ", "turn_right": "KeyE"}
    DECIDES = 0.1
    """[s] between two looks at where the robot is."""

    def __init__(self, browser: PageBrowser) -> None:
        self._browser = browser
        self._held = ""

    def press(self, arrow: str) -> None:
        """Hold this key, until it is another one's turn."""
        if arrow != self._held:
            self.rest()
            self._browser.key(self.KEYS[arrow], True)
            self._held = arrow
        time.sleep(self.DECIDES)

    def rest(self) -> None:
        """Let go."""
        if self._held:
            self._browser.key(self.KEYS[self._held], False)
        self._held = ""


class SwitchUser:
    """Has one switch, and presses it some time after the frame has come to where it should be.

    Args:
        reaction: [s].
    """

    def __init__(self, browser: PageBrowser, reaction: float = 0.25) -> None:
        self._browser, self._reaction = browser, reaction

    def press(self, arrow: str) -> None:
        """Choose an arrow and wait until the robot has done it."""
        self._wait_for_frame(arrow)
        time.sleep(self._reaction)
        self._browser.press("Space")
        if self._driving_soon():
            while _driving(self._browser):
                time.sleep(0.05)

    def rest(self) -> None:
        """Nothing is held: a step ends by itself."""

    def _wait_for_frame(self, arrow: str) -> None:
        """Wait until the arrow alone is framed; enter the arrows' group on the way."""
        while True:
            framed = self._browser.evaluate(
                "[...document.querySelectorAll('.scanned')].map((e) => e.dataset.drive ?? '')"
            )
            if framed == [arrow]:
                return
            if isinstance(framed, list) and len(framed) > 1 and arrow in framed:
                time.sleep(self._reaction)
                self._browser.press("Space")
            time.sleep(0.04)

    def _driving_soon(self) -> bool:
        deadline = time.monotonic() + 0.3
        while time.monotonic() < deadline:
            if _driving(self._browser):
                return True
            time.sleep(0.02)
        return False


class GazeUser:
    """Looks at what shall be pressed; the eye tracker's pointer trembles and comes late.

    Args:
        noise: Standard deviation of a reading [degrees] at the screen, each direction.
        lag: Of the pointer behind the eye [s].
        rate: Readings per second.
    """

    def __init__(
        self, browser: PageBrowser, noise: float = 1.5, lag: float = 0.15, rate: float = 30.0, seed: int = 1
    ) -> None:
        self._browser, self._period, self._random = browser, 1.0 / rate, random.Random(seed)
        self._spread = EYE_DISTANCE * math.tan(math.radians(noise)) / PIXEL
        self._late: deque[tuple[float, float]] = deque([(640.0, 300.0)] * round(lag * rate), maxlen=round(lag * rate))
        self._places: dict[str, tuple[float, float]] = {}

    def press(self, arrow: str) -> None:
        """Look at an arrow until the robot moves, then at the picture until it has done."""
        while not self._acts(arrow):
            self._look(*self._place(f"[data-drive={arrow}]"))
        while _driving(self._browser):
            self._look(*self._place("#view"))

    def rest(self) -> None:
        """Nothing is held: a step ends by itself."""

    def _acts(self, arrow: str) -> bool:
        return bool(self._browser.evaluate(f"document.querySelector('[data-drive={arrow}]').matches('.acting')"))

    def _place(self, selector: str) -> tuple[float, float]:
        if selector not in self._places:
            self._places[selector] = self._browser.place(selector)
        return self._places[selector]

    def _look(self, x: float, y: float) -> None:
        seen = self._late[0]
        self._late.append((x, y))
        self._browser.point(
            seen[0] + self._random.gauss(0.0, self._spread), seen[1] + self._random.gauss(0.0, self._spread)
        )
        time.sleep(self._period)
