"""The pilot's page in this process: real HTTPS, real WebRTC, a real drive_lease; the robot is a velocity and a picture.

For tests of the page itself; what a robot makes of the velocities is a test's own matter.
"""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections.abc import Callable, Coroutine, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from page_browser import Browser
from page_server import ANNA, WILL, NoConversation, OneRobot, OneStation
from waiting import wait_until

from pepper_sim.tablet.devtools import BrowserError
from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.page.app import PilotPage
from telepresence.page.certificate import server_context
from telepresence.page.proxy import Proxy
from telepresence.page.serving import serving
from telepresence.teleop.drive_lease import DriveLease
from telepresence.teleop.lease_client import LeaseClient
from telepresence.teleop.lease_messages import PILOT, WATCHER, Account, Reply, sign_joined
from telepresence.teleop.lease_topics import Asked, Joined, LeaseState
from telepresence.web.listener import listener, unix_listener

PERIOD = 0.05
"""[s] between two ticks of drive_lease."""


def account(name: str) -> Account:
    """Will watches, everybody else drives."""
    return Account(name, WATCHER if name == WILL["name"] else PILOT)


class QuietConversation(NoConversation):
    """Nothing is heard of this robot, and nobody there sees or hears the pilot."""

    def listen(self, take: Any) -> None:
        pass

    def show_face(self, jpeg: bytes | None) -> None:
        pass

    def state(self) -> dict[str, bool]:
        return {"speak": True, "listen": True, "face": True, "say": True}


class Robot(OneRobot):
    """`velocity` is what drive_lease lets through; its camera sends nothing while `dark`, and pictures that are `late`
    by so many seconds."""

    def __init__(self) -> None:
        super().__init__()
        self.dark, self.late = False, 0.0
        self.windows_beside: list[LeaseClient] = []
        self.conversation = QuietConversation()
        self.lease = DriveLease(account)
        self.velocity: Velocity = ZERO_VELOCITY
        self.driven: list[tuple[float, Velocity]] = []
        self.shown: dict[str, Any] = {"gate": None}
        """What `state` returns."""

    def lease_link(self, name: str) -> Link:
        return Link(self, f"/pilot_page/{name}")

    def state(self) -> dict[str, Any]:
        return self.shown

    def give(self, velocity: Velocity | None) -> None:
        if velocity is not None:
            self.velocity = velocity
            self.driven.append((time.monotonic(), velocity))

    def lease_state(self) -> LeaseState:
        now = time.monotonic()
        self.give(self.lease.tick(now))
        state = self.lease.state(now)
        present = tuple(zip(state.present, state.windows, strict=True))
        return LeaseState(
            "1", False, state.pilot, state.window, state.asking, state.stopped_by, state.hold, state.other,
            state.velocity, present, now,
        )  # fmt: skip


class Link:
    """A window's way to drive_lease."""

    def __init__(self, robot: Robot, node_name: str) -> None:
        self.robot, self.node_name = robot, node_name

    def send(self, session: str, command: Any) -> None:
        self.robot.give(self.robot.lease.receive(session, command, time.monotonic()))

    def join(self, claim: Any, session: str, proof: bytes, then: Callable[[Any], None]) -> None:
        lease, now = self.robot.lease, time.monotonic()
        if not session:
            offer = lease.offer(claim, now)
            then(_Answer(True, "", Joined(offer.session, offer.key, b"")))
            return
        window = lease.prove(claim, session, proof, now)
        if isinstance(window, Reply):
            then(_Answer(window.ok, window.reason, None))
            return
        reply = lease.admit(window, now)
        then(_Answer(reply.ok, reply.reason, Joined("", b"", sign_joined(window.key))))

    def ask(self, session: str, number: int, action: str, to: str, proof: bytes, then: Callable[[Any], None]) -> None:
        lease = self.robot.lease
        reply = lease.ask(session, number, action, to, proof, time.monotonic())
        then(_Answer(reply.ok, reply.reason, Asked(reply.ended, lease.sign(session, number, reply))))


class _Answer:
    def __init__(self, ok: bool, text: str, value: Any) -> None:
        self.ok, self.text, self.value = ok, text, value


class PageInProcess:
    """The page of one or more robots, on an event loop of its own.

    Args:
        folder: For its certificate and accounts.
        proxy: Behind which it is: at a unix socket, or with TLS on a free port.
    """

    def __init__(
        self, folder: Path, names: tuple[str, ...] = ("Pepper", "Robotino"), proxy: Proxy | None = None
    ) -> None:
        self._proxy = proxy
        self.robots = {name: Robot() for name in names}
        self._station = OneStation(folder, sign_in=False)  # drive_lease above knows no keys
        self._station.robots = self.robots
        self._folder = folder
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._end = asyncio.Event()
        self.url = ""
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self._thread.start()
        assert self._ready.wait(20.0), "the page does not start"

    def ask_for(self, robot: Robot, name: str) -> Callable[[], None]:
        """Let somebody ask for the robot in a window beside the page's; return what closes that window."""
        nobody = lambda *_: None  # noqa: E731
        window = LeaseClient(robot.lease_link(name), nobody, nobody, nobody)

        async def open_window() -> None:
            window.sign_in(account(name))
            robot.windows_beside.append(window)
            while not window.session:
                await asyncio.sleep(PERIOD)
            window.take()

        async def close_window() -> None:
            robot.windows_beside.remove(window)
            window.sign_out()

        self._do(open_window())
        return lambda: self._do(close_window())

    def _do(self, work: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(20.0)

    @property
    def entrance(self) -> PageInProcess:
        return self

    def asks(self, address: str) -> bool:
        return True

    def outdated(self, accounts: Iterable[Account]) -> dict[str, str]:
        return {}

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join(10.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        page = PilotPage(self._station, "127.0.0.1", folder=self._folder / "page", proxy=self._proxy)
        if self._proxy is not None and self._proxy.socket:
            listening, tls = unix_listener(Path(self._proxy.socket)), None
            self.url = self._proxy.url
        else:
            listening, tls = listener("127.0.0.1", 0), server_context(self._folder, {"127.0.0.1"})
            self.url = f"https://127.0.0.1:{listening.getsockname()[1]}/"
        async with serving(page.application(), page.admission, listening, tls):
            self._ready.set()
            await self._live(page)

    async def _live(self, page: PilotPage) -> None:
        level = 0
        while not self._end.is_set():
            level = (level + 5) % 200
            for name, robot in self.robots.items():
                state = robot.lease_state()
                page.receive(name, state)
                for window in robot.windows_beside:
                    window.receive(state)
                    window.renew()
                if not robot.dark:
                    robot.picture.put(np.full((180, 160), level, np.uint8), time.time() - robot.late)
            await asyncio.sleep(PERIOD)


class PageBrowser(Browser):
    """Chromium with the page in it."""

    def __init__(self, url: str, flags: Sequence[str] = ()) -> None:
        super().__init__("about:blank", flags=flags)
        self.url = url
        self._in: tuple[str, dict[str, Any]] | None = None
        self.size(1280, 800)

    def close(self) -> None:
        self.tools.close()

    def size(self, width: int, height: int, mobile: bool = False) -> None:
        self.tools.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=mobile
        )

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression, a promise's once it is kept. Raises AssertionError for what it throws."""
        answer = self.tools.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, str(answer["exceptionDetails"])[:1000]
        return answer["result"].get("value")

    def until(self, expression: str, what: str) -> None:
        def holds() -> Any:
            try:
                return self.evaluate(expression)
            except BrowserError as error:
                if "execution context" not in str(error).lower():
                    raise
                return False  # between two documents there is none

        wait_until(holds, f"{what} {self.errors}")

    def open(self, **settings: Any) -> None:
        """Open the page with these settings and nobody signed in."""
        self._in = None
        self.tools.call("Network.clearBrowserCookies")
        if not self.evaluate("location.href").startswith(self.url):
            self.tools.call("Page.navigate", url=f"{self.url}me")  # any page of that origin
            self.until("location.pathname === '/me'", "the station answers")
        self.evaluate(f"localStorage.setItem('pilot', JSON.stringify({json.dumps(settings)}))")
        self.tools.call("Page.navigate", url=self.url)
        self.until(
            "location.pathname === '/' && document.readyState === 'complete'"
            " && document.getElementById('enter')?.hidden === false",
            "the page asks who it is",
        )

    def drive(self, name: str = "anna", **settings: Any) -> None:
        """Open the page and sign in, unless it is so already; a free robot is taken."""
        if self._in == (name, settings):
            return
        self.open(**settings)
        self.sign_in(name, WILL["password"] if name == WILL["name"] else ANNA["password"])
        self.until("document.getElementById('picture').videoWidth > 0", "the picture is there")
        if name != "will":
            self.until("document.getElementById('take').hidden", "the robot is taken")
        self._in = name, settings

    def press(self, code: str, key: str = "") -> None:
        """Press a key and release it."""
        for kind in ("keyDown", "keyUp"):
            self.tools.call("Input.dispatchKeyEvent", type=kind, code=code, key=key or code)

    def point(self, x: float, y: float) -> None:
        self.tools.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def place(self, selector: str) -> tuple[float, float]:
        """Return the middle of an element [px]."""
        x, y = self.evaluate(
            f"(() => {{ const b = document.querySelector('{selector}').getBoundingClientRect();"
            "return [(b.left + b.right) / 2, (b.top + b.bottom) / 2]; })()"
        )
        return x, y

    def click(self, selector: str) -> None:
        x, y = self.place(selector)
        for kind in ("mousePressed", "mouseReleased"):
            self.tools.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
