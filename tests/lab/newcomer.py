"""Somebody who was given a link to the pilot's page and has read nothing: taps it, sees, holds forward."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from page_browser import Browser
from repeated_presses import PATIENCE

FIRST_PICTURE = """
addEventListener("DOMContentLoaded", () => {
  document.getElementById("picture")?.requestVideoFrameCallback((now) => { window.firstPicture = now; });
});
"""
"""`now` counts from the tap on the link: performance.timeOrigin."""


@dataclass(frozen=True)
class Screen:
    """What a newcomer holds: CSS pixels; `touch` has no keyboard."""

    name: str
    width: int
    height: int
    touch: bool = False


DESKTOP = Screen("desktop", 1280, 800)
PHONE = Screen("phone", 390, 844, touch=True)
SCREENS = (DESKTOP, PHONE)


class Newcomer(Browser):
    """A browser that nobody has used yet.

    Args:
        screen: What its owner looks at.
        before: A script that runs before the page's own.
        flags: Further options of Chromium.
    """

    def __init__(self, screen: Screen, before: str = "", flags: Sequence[str] = ()) -> None:
        super().__init__("about:blank", FIRST_PICTURE + before, flags)
        self.screen = screen
        self._held_since = -math.inf
        self.tools.call(
            "Emulation.setDeviceMetricsOverride", width=screen.width, height=screen.height,
            deviceScaleFactor=2 if screen.touch else 1, mobile=screen.touch,
        )  # fmt: skip
        self.tools.call("Emulation.setTouchEmulationEnabled", enabled=screen.touch)

    def tap(self, link: str) -> None:
        """Open the link, as one who was never here before."""
        self.tools.call("Page.navigate", url="about:blank")
        self.tools.call("Network.clearBrowserCookies")
        self.tools.call("Page.navigate", url=link)

    def first_picture(self) -> float | None:
        """Seconds from the tap to the first picture; None before it."""
        shown = self.evaluate("window.firstPicture ?? null")
        return None if shown is None else shown / 1000.0

    def press(self, selector: str) -> None:
        """Click or tap on what matches."""
        x, y = self._middle(selector)
        if self.screen.touch:
            self._touch("touchStart", x, y)
            self._touch("touchEnd")
        else:
            for kind in ("mousePressed", "mouseReleased"):
                self.tools.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def hold_forward(self) -> None:
        """Hold what looks like forward: the key W, or the arrow under the thumb."""
        if self.screen.touch:
            self._touch("touchStart", *self._middle('#pad [data-drive="forward"]'))
        else:
            self.key("KeyW", True)

    def insists(self) -> bool:
        """Hold forward, and press anew what has moved nothing for a while; true.

        A page that gets no picture or no processor for half a second lets go of what is held.
        """
        if time.monotonic() - self._held_since > PATIENCE:
            if math.isfinite(self._held_since):  # a finger that touches nothing can't be lifted
                self.let_go()
            self.hold_forward()
            self._held_since = time.monotonic()
        return True

    def let_go(self) -> None:
        """Hold it no more."""
        self._held_since = -math.inf
        if self.screen.touch:
            self._touch("touchEnd")
        else:
            self.key("KeyW", False)

    def holds_nothing(self) -> bool:
        """Whether nothing looks held any more."""
        return self.evaluate("!document.querySelector('.pad .held')")

    def _touch(self, kind: str, x: float | None = None, y: float | None = None) -> None:
        points = [] if x is None else [{"x": x, "y": y}]
        self.tools.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def _middle(self, selector: str) -> list[float]:
        return self.evaluate(
            f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2])"
            f"(document.querySelector({selector!r}).getBoundingClientRect())"
        )
