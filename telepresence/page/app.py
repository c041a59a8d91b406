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
import time
from collections.abc import Awaitable, Callable, Iterable
from pathlib import Path
from typing import Any

from aiohttp import web

from telepresence.page.audit import Audit
from telepresence.page.browser_link import BrowserLink
from telepresence.page.browser_messages import StationEnd
from telepresence.page.browser_socket import BrowserSocket
from telepresence.page.browser_window import BrowserWindow
from telepresence.page.commands import AskMessage
from telepresence.page.people import PeopleReport, people_of
from telepresence.page.proxy import Proxy
from telepresence.page.published_ports import published_ports
from telepresence.page.relays import Relays
from telepresence.page.robot_on_page import RobotOnPage
from telepresence.page.serving import page_admission
from telepresence.page.sign_in_routes import SignInRoutes, read_fields, refuse
from telepresence.page.sign_ins import SignIn, SignIns
from telepresence.page.station import Stations
from telepresence.page.tabs import Tab, Tabs
from telepresence.teleop.lease_topics import LeaseState
from telepresence.web.admission import Standing
from telepresence.web.origin import foreign, own_names

log = logging.getLogger(__name__)

STATIC = Path(__file__).parent / "static"
MOST_BODY = 64 * 1024
"""Bytes of a request."""
CHECK_PERIOD = 0.05
_MOST_DIGITS = 15
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
            stations.entrance, sign_ins, self._audit, list(self._robots), self._on_signed_out, proxy
        )
        self.admission = page_admission(proxy)
        """Whose connections are served, see `serving`."""
        self._tabs = Tabs(self._sign_in_routes.holds, self._drives, self._leave)
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
        await asyncio.gather(*(link.close() for link in list(self._tabs.links.values())))
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
            robot.note_who_looks(self._tabs.links.keys())
        await self._tabs.forget_gone(now)

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
        except web.RequestPayloadError:
            response = refuse(400, "That cannot be read.")
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
        tab = await self._tabs.open(sign_in, fields["page"])
        await self._make_room(tab, robot, fields["attempt"])
        end = self._station_end(tab, robot)
        link = BrowserLink(robot.pictures, end, self._tabs.note_end, self._relays, robot.conversation)
        self._tabs.links[tab] = link
        try:
            answer = await link.answer(fields["sdp"], self._address, request.host, self._ports)
        except ValueError as error:
            return refuse(400, str(error))
        return web.json_response({"sdp": answer, "servers": self._relays.for_browser(sign_in.name, time.time())})

    async def _websocket(self, request: web.Request) -> web.StreamResponse:
        tab = await self._tabs.open(self._who(request), request.query.get("page", ""))
        robot = self._robot(request.query.get("robot", ""))
        await self._make_room(tab, robot, _attempt(request.query.get("attempt", "")))
        socket = BrowserSocket(robot.pictures, self._station_end(tab, robot), self._tabs.note_end)
        self._tabs.links[tab] = socket
        self.admission.known(request.transport, Standing.KEPT)
        return await socket.serve(request)

    async def _make_room(self, tab: Tab, robot: RobotOnPage, attempt: float) -> None:
        """End what this page has had before: it dials again, or looks at another robot. Raises HTTPException."""
        await self._tabs.make_room(tab, attempt)
        for other in self._robots.values():
            if other is not robot:  # who looks at one robot drives no other
                other.leave(tab)

    def _station_end(self, tab: Tab, robot: RobotOnPage) -> StationEnd:
        window, people = robot.window(tab, lambda text: self._say(tab, text)), PeopleReport()
        return StationEnd(
            window,
            lambda: self._state(tab, robot, window) | people.add(people_of(robot.lease, window.node), time.monotonic()),
            lambda action, value: robot.station.request(action, value, tab.sign_in.account),
            lambda: self._tabs.note_flood(tab),
        )

    async def _stop(self, request: web.Request) -> web.StreamResponse:
        sign_in = self._who(request)
        fields = await read_fields(request, {"robot": str, "page": str})
        robot, tab = self._robot(fields["robot"]), await self._tabs.open(sign_in, fields["page"])
        window = robot.window(tab, lambda text: self._say(tab, text))
        window.ask(AskMessage(1, "stop", None))
        return web.json_response({})

    async def _on_signed_out(self, sign_in: SignIn) -> None:
        await self._tabs.forget_all_of(sign_in)

    def _who(self, request: web.Request) -> SignIn:
        return self._sign_in_routes.who(request)

    def _robot(self, name: str) -> RobotOnPage:
        if name not in self._robots:
            raise web.HTTPNotFound(reason="There is no such robot.")
        return self._robots[name]

    def _say(self, tab: Tab, text: str) -> None:
        if tab in self._tabs.links:
            self._tabs.links[tab].messages.say(text)

    def _state(self, tab: Tab, robot: RobotOnPage, window: BrowserWindow) -> dict[str, Any]:
        tab.used, tab.sign_in.used = time.monotonic(), time.time()
        return robot.station.state() | window.describe()

    def _drives(self, tab: Tab) -> bool:
        return any(robot.windows[tab].mine for robot in self._robots.values() if tab in robot.windows)

    def _leave(self, tab: Tab) -> None:
        for robot in self._robots.values():
            robot.leave(tab)


def _attempt(word: str) -> int:
    """Return the number of an attempt. Raises HTTPBadRequest."""
    if not word.isdecimal() or len(word) > _MOST_DIGITS:
        raise web.HTTPBadRequest(reason="An attempt has a number.")
    return int(word)
