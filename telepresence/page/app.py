"""The pilot's page as an aiohttp application.

    GET /               the page; GET /static/NAME: its parts
    POST /enter, ...    coming in: see `entering`
    GET /servers        {"servers"}: JavaScript's iceServers, for the first offer
    POST /offer         {"robot", "page", "attempt", "sdp"}    {"sdp", "servers"}: WebRTC's answer; for the next offer
    GET /ws?robot&page&attempt                                     a websocket without WebRTC: see `browser_socket.py`
    POST /stop          {"robot", "page"}                  the red stop, when no channel is open

`page` names one loading of the page: 16 hexadecimal digits that it has thrown. Two tabs share a cookie, and a page that
is loaded anew counts from one again; each is a window of drive_lease of its own. `attempt` counts up, as one that a cut
has held up must not end the connection of a later one.

Every request names this machine, comes from our own page or from no page at all, and is small; but for the page itself
and `enter` it shows the cookie of a sign-in.
"""

from __future__ import annotations

import asyncio
import logging
import re
import time
from collections.abc import Awaitable, Callable, Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aiohttp import web

from telepresence.page.attempts import Attempts
from telepresence.page.audit import Audit
from telepresence.page.browser_conversation import RobotConversation
from telepresence.page.browser_link import BrowserLink
from telepresence.page.browser_messages import StationEnd
from telepresence.page.browser_socket import BrowserSocket
from telepresence.page.browser_window import BrowserWindow
from telepresence.page.commands import AskMessage
from telepresence.page.people import PeopleReport, people_of
from telepresence.page.pictures import Pictures
from telepresence.page.proxy import Proxy
from telepresence.page.published_ports import published_ports
from telepresence.page.relays import Relays
from telepresence.page.serving import page_admission
from telepresence.page.sign_in_routes import SignInRoutes, read_fields, refuse
from telepresence.page.sign_ins import SignIn, SignIns
from telepresence.page.station import Station, Stations
from telepresence.teleop.accounts import is_guest_name
from telepresence.teleop.lease_topics import LeaseState
from telepresence.web.admission import Standing
from telepresence.web.origin import foreign, own_names

log = logging.getLogger(__name__)

STATIC = Path(__file__).parent / "static"
MOST_BODY = 64 * 1024
"""Bytes of a request."""
CHECK_PERIOD = 0.05
BROWSER_KEPT = 10.0
"""[s] for which a page without a connection stays a window of drive_lease: it may dial again."""
MOST_TABS = 4
"""Pages of one sign-in: the one that was heard last longest ago ends."""
_TAB = re.compile("[0-9a-f]{16}")
_MOST_DIGITS = 15
DIALS = (40, 10.0)
"""Connections of one sign-in in so many seconds, of all its pages. Each costs keys and sockets."""
NEW_TABS = (20, 10.0)
"""Pages that one sign-in opens in so many seconds. Each is a window of drive_lease, which proves itself."""
FLOODS = (1, 5.0)
"""Connections of one sign-in that are given up for sending too much, in so many seconds: then it dials in vain."""
MOST_LINKS = 16
"""Browsers that are connected at the same time."""
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; media-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(self), microphone=(self), gamepad=(self), fullscreen=(self)",
    "Referrer-Policy": "no-referrer",
    "Strict-Transport-Security": "max-age=31536000",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@dataclass(eq=False)
class Tab:
    """One page of a browser.

    Attributes:
        name: Names it, as a node does a window: for others to see, and no secret.
        used: When it was last connected [monotonic s].
        refused: How many of its messages were, as far as that is in the audit.
        attempt: Number of its newest offer, or websocket.
    """

    sign_in: SignIn
    number: str
    used: float
    refused: int = 0
    attempt: float = 0.0

    @property
    def name(self) -> str:
        return f"{self.sign_in.name}_{self.number}"


class RobotOnPage:
    """One robot: its pictures, and the browsers that are windows of its drive_lease."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.pictures = Pictures(station.picture, station.watch)
        self.conversation = RobotConversation(station.conversation)
        self.windows: dict[Tab, BrowserWindow] = {}
        self.lease: LeaseState | None = None
        self._looking: list[str] | None = None  # what a program before this one has said, nobody here knows

    def note_who_looks(self, connected: Collection[Tab]) -> None:
        """Say who looks at the robot, when that has changed."""
        looking = sorted({tab.sign_in.account.name for tab in self.windows if tab in connected})
        if looking != self._looking:
            self._looking = looking
            self.station.show_who_looks(looking)

    def window(self, tab: Tab, say: Callable[[str], None]) -> BrowserWindow:
        """Return this page's way to drive; it outlives connections."""
        if tab not in self.windows:
            link, account = self.station.lease_link(tab.name), tab.sign_in.account
            window = BrowserWindow(link, account, say, self.station.floor)
            self.windows[tab] = window
            if self.lease is not None:
                window.receive(self.lease)
        return self.windows[tab]

    def leave(self, tab: Tab) -> None:
        """This page does not look at the robot any more."""
        if tab in self.windows:
            self.windows.pop(tab).end()


class PilotPage:
    """Everybody's browsers. Belongs to one event loop.

    Args:
        address: Of this machine, where browsers are to find the pictures; None for all.
        relays: Servers that help through the internet.
        names: Of this machine, besides its addresses: what browsers may call it.
        folder: For the sign-ins and the audit; None to keep neither.
        proxy: Through which browsers may come.
    """

    def __init__(
        self,
        stations: Stations,
        address: str | None = None,
        relays: Relays | None = None,
        names: Iterable[str] = (),
        folder: Path | None = None,
        proxy: Proxy | None = None,
    ) -> None:
        self._address, self._relays, self._ports = address, relays or Relays(), published_ports()
        self._robots = {name: RobotOnPage(station) for name, station in stations.robots.items()}
        self._audit = Audit(folder / "audit.log" if folder else None)
        sign_ins = SignIns(folder / "sign_ins" if folder else None)
        self._sign_in_routes = SignInRoutes(
            stations.entrance, sign_ins, self._audit, list(self._robots), self._on_left, proxy
        )
        self.admission = page_admission(proxy)
        """Whose connections are served, see `serving`."""
        self._tabs: dict[tuple[SignIn, str], Tab] = {}
        self._links: dict[Tab, BrowserLink | BrowserSocket] = {}
        self._dials, self._new_tabs, self._floods = Attempts(*DIALS), Attempts(*NEW_TABS), Attempts(*FLOODS)
        self._names = own_names() | {name.lower() for name in (*names, *([proxy.name] if proxy else ()))}

    def application(self) -> web.Application:
        """Return what aiohttp serves."""
        application = web.Application(middlewares=[self._checked], client_max_size=MOST_BODY)
        application.add_routes(
            [
                web.get("/", self._page),
                web.get(r"/static/{name:[a-z_]{1,40}\.(js|css|svg|json)}", self._static),
                *self._sign_in_routes.routes(),
                web.get("/servers", self._servers),
                web.post("/offer", self._offer),
                web.get("/ws", self._websocket),
                web.post("/stop", self._stop),
            ]
        )
        application.cleanup_ctx.append(self._running)
        return application

    def receive(self, robot: str, state: LeaseState) -> None:
        """Take what the drive_lease of a robot says."""
        page = self._robots[robot]
        self._note_changes(robot, page.lease, state)
        page.lease = state
        for window in page.windows.values():
            window.receive(state)

    def _note_changes(self, robot: str, before: LeaseState | None, state: LeaseState) -> None:
        if before is None or (before.window, before.pilot) != (state.window, state.pilot):
            if state.pilot or before is not None:
                self._audit.note("drives" if state.pilot else "nobody drives", robot=robot, name=state.pilot)
        if (before.stopped_by if before else "") != state.stopped_by:
            self._audit.note("stop" if state.stopped_by else "stop is over", robot=robot, name=state.stopped_by)

    async def _running(self, _application: web.Application):
        checks = [asyncio.ensure_future(task) for task in (self._check(), self._sign_in_routes.revise())]
        yield
        for check in checks:
            check.cancel()
        await asyncio.gather(*(link.close() for link in list(self._links.values())))
        for robot in self._robots.values():
            for tab in list(robot.windows):
                robot.leave(tab)
        self._sign_in_routes.close()

    async def _check(self) -> None:
        while True:
            try:
                await self._check_once(time.monotonic())
            except Exception:  # whatever it was: silent browsers must be stopped, and those that have gone forgotten
                log.exception("a look at the browsers failed")
            await asyncio.sleep(CHECK_PERIOD)

    async def _check_once(self, now: float) -> None:
        for robot in self._robots.values():
            for tab, window in robot.windows.items():
                window.check(now)
                if window.refused > tab.refused:
                    tab.refused = window.refused
                    self._audit.sample("refused messages", name=tab.sign_in.account.name, browser=tab.name)
            robot.note_who_looks(self._links.keys())
        for tab in list(self._tabs.values()):
            if tab not in self._links and now - tab.used > BROWSER_KEPT:
                await self._forget(tab)

    @web.middleware
    async def _checked(
        self, request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        headers = {f"HTTP_{name.upper().replace('-', '_')}": value for name, value in request.headers.items()}
        reason = foreign(headers, self._names, scheme="https")
        self.admission.asked(request.transport)
        try:
            if not reason:
                await self._sign_in_routes.recognize(request)
            sign_in = None if reason else self._sign_in_routes.sign_in(request)
            standing = Standing.SIGNED_IN if sign_in else Standing.STRANGER
            party = sign_in.name if sign_in else self._sign_in_routes.network(request)
            self.admission.known(request.transport, standing, party)
            response = refuse(403, reason) if reason else await handler(request)
        except web.HTTPException as error:
            response = refuse(error.status, error.reason)
        finally:
            self.admission.answered(request.transport)
        if not response.prepared:  # a websocket is, and is over
            response.headers.update(_HEADERS)
        return response

    async def _page(self, _request: web.Request) -> web.StreamResponse:
        return web.FileResponse(STATIC / "index.html")

    async def _static(self, request: web.Request) -> web.StreamResponse:
        file = STATIC / request.match_info["name"]
        return web.FileResponse(file) if file.is_file() else refuse(404, "There is no such file.")

    async def _servers(self, request: web.Request) -> web.StreamResponse:
        sign_in = self._who(request)
        return web.json_response({"servers": self._relays.for_browser(sign_in.name, time.time())})

    async def _offer(self, request: web.Request) -> web.StreamResponse:
        sign_in = self._who(request)
        fields = await read_fields(request, {"robot": str, "page": str, "attempt": float, "sdp": str})
        robot = self._robot(fields["robot"])
        tab = await self._tab(sign_in, fields["page"])
        await self._make_room(tab, robot, fields["attempt"])
        end = self._station_end(tab, robot)
        link = BrowserLink(robot.pictures, end, self._on_link_ended, self._relays, robot.conversation)
        self._links[tab] = link
        try:
            answer = await link.answer(fields["sdp"], self._address, request.host, self._ports)
        except ValueError as error:
            return refuse(400, str(error))
        return web.json_response({"sdp": answer, "servers": self._relays.for_browser(sign_in.name, time.time())})

    async def _websocket(self, request: web.Request) -> web.StreamResponse:
        tab = await self._tab(self._who(request), request.query.get("page", ""))
        robot = self._robot(request.query.get("robot", ""))
        await self._make_room(tab, robot, _attempt(request.query.get("attempt", "")))
        socket = BrowserSocket(robot.pictures, self._station_end(tab, robot), self._on_link_ended)
        self._links[tab] = socket
        self.admission.known(request.transport, Standing.KEPT)
        return await socket.serve(request)

    async def _make_room(self, tab: Tab, robot: RobotOnPage, attempt: float) -> None:
        """End what this page has had before: it dials again, or looks at another robot. Raises HTTPException."""
        if self._floods.wait(tab.sign_in.name, time.monotonic()):
            raise web.HTTPTooManyRequests(reason="This page has sent too much. It may dial again in some seconds.")
        if self._dials.wait(tab.sign_in.name, time.monotonic()):
            raise web.HTTPTooManyRequests(reason="This page dials too often.")
        self._dials.note(tab.sign_in.name, time.monotonic())
        if not attempt > tab.attempt:  # after a cut, what was sent in it comes late
            raise web.HTTPConflict(reason="A later attempt was here first.")
        tab.attempt = attempt
        if tab in self._links:  # what the old connection still delivers is late
            await self._end_link(tab, tab, attempt)
        while len(self._links) >= MOST_LINKS:
            driving = {one for each in self._robots.values() for one, window in each.windows.items() if window.mine}
            newest = (other for other in reversed(self._links) if is_guest_name(other.sign_in.account.name))
            guests = sorted(newest, key=driving.__contains__)  # who drives goes last
            if is_guest_name(tab.sign_in.account.name) or not guests:
                raise web.HTTPServiceUnavailable(reason=f"{MOST_LINKS} browsers are connected, which is the limit.")
            await self._end_link(guests[0], tab, attempt)  # guests of one link keep nobody out who has an account
        for other in self._robots.values():
            if other is not robot:  # who looks at one robot drives no other
                other.leave(tab)

    async def _end_link(self, ended: Tab, tab: Tab, attempt: float) -> None:
        """Make room for this attempt of a page, unless it is over by the time. Raises HTTPConflict."""
        await self._links.pop(ended).close()
        if tab.attempt != attempt:
            raise web.HTTPConflict(reason="A later attempt was here first.")
        if self._tabs.get((tab.sign_in, tab.number)) is not tab:
            raise web.HTTPConflict(reason="This page was closed while it dialled.")

    def _station_end(self, tab: Tab, robot: RobotOnPage) -> StationEnd:
        window, people = robot.window(tab, lambda text: self._say(tab, text)), PeopleReport()
        return StationEnd(
            window,
            lambda: self._state(tab, robot, window) | people.add(people_of(robot.lease, window.node), time.monotonic()),
            lambda action, value: robot.station.request(action, value, tab.sign_in.account),
            lambda: self._floods.note(tab.sign_in.name, time.monotonic()),
        )

    async def _stop(self, request: web.Request) -> web.StreamResponse:
        sign_in = self._who(request)
        fields = await read_fields(request, {"robot": str, "page": str})
        robot, tab = self._robot(fields["robot"]), await self._tab(sign_in, fields["page"])
        window = robot.window(tab, lambda text: self._say(tab, text))
        window.ask(AskMessage(1, "stop", None))
        return web.json_response({})

    async def _on_left(self, sign_in: SignIn) -> None:
        for tab in self._tabs_of(sign_in):
            await self._forget(tab)

    def _who(self, request: web.Request) -> SignIn:
        return self._sign_in_routes.who(request)

    async def _tab(self, sign_in: SignIn, number: str) -> Tab:
        if not _TAB.fullmatch(number):
            raise web.HTTPBadRequest(reason="A page's name has 16 hexadecimal digits.")
        if not self._sign_in_routes.holds(sign_in):  # it has ended while the body came
            raise web.HTTPUnauthorized(reason="Sign in first.")
        now = time.monotonic()
        if (sign_in, number) not in self._tabs:
            if self._new_tabs.wait(sign_in.name, now):
                raise web.HTTPTooManyRequests(reason="Too many pages are opened.")
            self._new_tabs.note(sign_in.name, now)
            others = sorted(self._tabs_of(sign_in), key=lambda tab: tab.used)
            for tab in others[: max(0, len(others) - MOST_TABS + 1)]:
                await self._forget(tab)
        tab = self._tabs.setdefault((sign_in, number), Tab(sign_in, number, now))
        tab.used = now
        return tab

    def _tabs_of(self, sign_in: SignIn) -> list[Tab]:
        return [tab for tab in self._tabs.values() if tab.sign_in is sign_in]

    async def _forget(self, tab: Tab) -> None:
        self._tabs.pop((tab.sign_in, tab.number), None)
        link = self._links.pop(tab, None)
        if link is not None:
            await link.close()
        for robot in self._robots.values():
            robot.leave(tab)

    def _robot(self, name: str) -> RobotOnPage:
        if name not in self._robots:
            raise web.HTTPNotFound(reason="There is no such robot.")
        return self._robots[name]

    def _say(self, tab: Tab, text: str) -> None:
        if tab in self._links:
            self._links[tab].messages.say(text)

    def _state(self, tab: Tab, robot: RobotOnPage, window: BrowserWindow) -> dict[str, Any]:
        tab.used, tab.sign_in.used = time.monotonic(), time.time()
        return robot.station.state() | window.describe()

    def _on_link_ended(self, link: BrowserLink | BrowserSocket) -> None:
        for tab, one in list(self._links.items()):
            if one is link:
                del self._links[tab]


def _attempt(word: str) -> int:
    """Return the number of an attempt. Raises HTTPBadRequest."""
    if not word.isdecimal() or len(word) > _MOST_DIGITS:
        raise web.HTTPBadRequest(reason="An attempt has a number.")
    return int(word)
