"""The pilot's page as an aiohttp application.

    GET /               the page; GET /static/NAME: its parts
    POST /enter         {"name": ..., "password": ...}     200 and a cookie; 403 with a sentence
    POST /leave         ends the sign-in
    GET /me             who has signed in, and which robot this is; 401 for nobody
    POST /offer         {"sdp": ...}                       {"sdp": ...}: WebRTC's answer
    POST /stop          the red stop, when no channel is open

Every request names this machine, comes from our own page or from no page at all, and is small; but for the page itself
and `enter` it shows the cookie of a sign-in.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Protocol

from aiohttp import web

from telepresence.page.browser_link import BrowserLink
from telepresence.page.browser_window import BrowserWindow
from telepresence.page.commands import AskMessage
from telepresence.page.shared_video import SharedVideo
from telepresence.page.sign_ins import COOKIE, LIFE, SignIn, SignIns
from telepresence.teleop.lease_client import LeaseLink
from telepresence.teleop.lease_messages import Account
from telepresence.teleop.lease_topics import LeaseState
from telepresence.video.images import LatestImage
from telepresence.web.origin import foreign, own_names

log = logging.getLogger(__name__)

STATIC = Path(__file__).parent / "static"
MOST_BODY = 64 * 1024
"""Bytes of a request."""
CHECK_PERIOD = 0.05
MOST_AT_ONCE = 2
"""Passwords that are checked at the same time: each takes 0.1 s of a core and some memory."""
MOST_WAITING = 16
"""Further ones that wait for that."""
BROWSER_KEPT = 10.0
"""[s] for which a browser without a connection stays a window of drive_lease: it may dial again."""
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


class Station(Protocol):
    """What the page needs of the robot's station."""

    robot: str
    """What the robot is called."""
    picture: LatestImage
    """Its newest picture, as `telepresence.video.webrtc.planes_of` makes them."""

    def watch(self, wanted: bool) -> None:
        """Take pictures, or take none: nobody looks."""

    def admit(self, name: str, password: str) -> Account:
        """Return the account; runs on a thread. Raises UserError with a sentence."""

    def lease_link(self, name: str) -> LeaseLink:
        """Return a way to drive_lease for a window of this name."""

    def state(self) -> dict[str, Any]:
        """Return what the page shows of the robot besides who drives, as JSON's types."""


class PilotPage:
    """Everybody's browsers. Belongs to one event loop.

    Args:
        address: Of this machine, where browsers are to find the pictures; None for all.
    """

    def __init__(self, station: Station, address: str | None = None) -> None:
        self._station, self._address = station, address
        self._video = SharedVideo(station.picture, station.watch)
        self._sign_ins = SignIns()
        self._windows: dict[SignIn, BrowserWindow] = {}
        self._links: dict[SignIn, BrowserLink] = {}
        self._asked = itertools.count(1)
        self._checking = asyncio.Semaphore(MOST_AT_ONCE)
        self._waiting = 0
        self._names = own_names()
        self._lease: LeaseState | None = None

    def application(self) -> web.Application:
        """Return what aiohttp serves."""
        application = web.Application(middlewares=[self._checked], client_max_size=MOST_BODY)
        application.add_routes(
            [
                web.get("/", self._page),
                web.get(r"/static/{name:[a-z_]{1,40}\.(js|css|svg)}", self._static),
                web.post("/enter", self._enter),
                web.post("/leave", self._leave),
                web.get("/me", self._me),
                web.post("/offer", self._offer),
                web.post("/stop", self._stop),
            ]
        )
        application.cleanup_ctx.append(self._running)
        return application

    def receive(self, state: LeaseState) -> None:
        """Take what drive_lease says."""
        self._lease = state
        for window in self._windows.values():
            window.receive(state)

    async def _running(self, _application: web.Application):
        checks = asyncio.ensure_future(self._check())
        yield
        checks.cancel()
        await asyncio.gather(*(link.close() for link in list(self._links.values())))
        for window in self._windows.values():
            window.end()

    async def _check(self) -> None:
        while True:
            now = time.monotonic()
            for sign_in, window in list(self._windows.items()):
                window.check(now)
                if sign_in not in self._links and now - sign_in.used > BROWSER_KEPT:
                    window.end()
                    del self._windows[sign_in]
            await asyncio.sleep(CHECK_PERIOD)

    @web.middleware
    async def _checked(
        self, request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        headers = {f"HTTP_{name.upper().replace('-', '_')}": value for name, value in request.headers.items()}
        reason = foreign(headers, self._names, scheme="https")
        try:
            response = _refuse(403, reason) if reason else await handler(request)
        except web.HTTPException as error:
            response = _refuse(error.status, error.reason)
        response.headers.update(_HEADERS)
        return response

    async def _page(self, _request: web.Request) -> web.StreamResponse:
        return web.FileResponse(STATIC / "index.html")

    async def _static(self, request: web.Request) -> web.StreamResponse:
        file = STATIC / request.match_info["name"]
        return web.FileResponse(file) if file.is_file() else _refuse(404, "There is no such file.")

    async def _enter(self, request: web.Request) -> web.StreamResponse:
        fields = await _fields(request, {"name", "password"})
        if self._waiting >= MOST_WAITING:
            return _refuse(429, "Too many people try to come in. Wait a moment.")
        self._waiting += 1
        try:
            async with self._checking:
                account = await asyncio.to_thread(self._station.admit, fields["name"], fields["password"])
        except ValueError as error:
            return _refuse(403, str(error))
        finally:
            self._waiting -= 1
        cookie, _ = self._sign_ins.begin(account, time.monotonic())
        response = web.json_response(self._about(account))
        response.set_cookie(
            COOKIE, cookie, max_age=round(LIFE), path="/", secure=True, httponly=True, samesite="Strict"
        )
        return response

    async def _leave(self, request: web.Request) -> web.StreamResponse:
        sign_in = self._who(request)
        self._sign_ins.end(request.cookies.get(COOKIE, ""))
        if sign_in in self._links:
            await self._links[sign_in].close()
        if sign_in in self._windows:
            self._windows.pop(sign_in).end()
        response = web.json_response({})
        response.del_cookie(COOKIE, path="/", secure=True, httponly=True, samesite="Strict")
        return response

    async def _me(self, request: web.Request) -> web.StreamResponse:
        return web.json_response(self._about(self._who(request).account))

    async def _offer(self, request: web.Request) -> web.StreamResponse:
        sign_in = self._who(request)
        fields = await _fields(request, {"sdp"})
        before = self._links.pop(sign_in, None)
        if before is not None:  # it dials again: what the old connection still delivers is late
            await before.close()
        if len(self._links) >= MOST_LINKS:
            return _refuse(503, f"{MOST_LINKS} browsers are connected, which is the limit.")
        window = self._window(sign_in)
        link = BrowserLink(window, self._video, lambda: self._state(sign_in, window), self._on_link_ended)
        self._links[sign_in] = link
        try:
            answer = await link.answer(fields["sdp"], self._address)
        except ValueError as error:
            return _refuse(400, str(error))
        return web.json_response({"sdp": answer})

    async def _stop(self, request: web.Request) -> web.StreamResponse:
        self._window(self._who(request)).ask(AskMessage(next(self._asked), "stop", ""))
        return web.json_response({})

    def _who(self, request: web.Request) -> SignIn:
        sign_in = self._sign_ins.find(request.cookies.get(COOKIE, ""), time.monotonic())
        if sign_in is None:
            raise web.HTTPUnauthorized(reason="Sign in first.")
        return sign_in

    def _window(self, sign_in: SignIn) -> BrowserWindow:
        if sign_in not in self._windows:
            window = BrowserWindow(self._station.lease_link(sign_in.name), sign_in.account, lambda text: None)
            self._windows[sign_in] = window
            if self._lease is not None:
                window.receive(self._lease)
        return self._windows[sign_in]

    def _state(self, sign_in: SignIn, window: BrowserWindow) -> dict[str, Any]:
        sign_in.used = time.monotonic()
        return self._station.state() | window.describe()

    def _on_link_ended(self, link: BrowserLink) -> None:
        for sign_in, one in list(self._links.items()):
            if one is link:
                del self._links[sign_in]

    def _about(self, account: Account) -> dict[str, Any]:
        return {"name": account.name, "role": account.role, "robot": self._station.robot}


async def _fields(request: web.Request, names: set[str]) -> dict[str, str]:
    """Return the texts of a body. Raises HTTPBadRequest."""
    try:
        fields = await request.json()
    except (ValueError, RecursionError):
        fields = None
    if not isinstance(fields, dict) or set(fields) != names or not all(isinstance(v, str) for v in fields.values()):
        raise web.HTTPBadRequest(reason=f"The body must be JSON with the texts {', '.join(sorted(names))}.")
    return fields


def _refuse(status: int, reason: str) -> web.Response:
    return web.json_response({"reason": reason}, status=status)
