"""What the robot's two WebRTC services have in common: HTTP for few, who prove that they have the robot's key.

Nobody else gets more than a short refusal, and nothing is made for them: see
`telepresence.security.signed_requests`. Without a key only this machine's own user is served: the other end must be a
program of the same user, the request's Host an address or localhost, and no web page may have sent it (Origin).
"""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import time
from collections.abc import Awaitable, Callable

from aiohttp import web

from telepresence.security import local_users
from telepresence.security.robot_key import RobotKey
from telepresence.security.signed_requests import (
    Answer,
    Challenges,
    Request,
    answer_proof,
    ask_for_proof,
    credentials_in,
    proven,
)
from telepresence.station import heartbeat
from telepresence.web.admission import Admission, Limits
from telepresence.web.listener import listener
from telepresence.web.request_log import request_log

log = logging.getLogger(__name__)

SDP = "application/sdp"
MAX_OFFER = 64 * 1024
"""Bytes."""
BODY_TIMEOUT = 2.0
"""Seconds for the whole body of a request."""
ANSWER_TIMEOUT = 5.0
"""Seconds for the answer to it."""
MAX_HEADERS = 24
HEADER_TIMEOUT = 2.0
"""Seconds within which a connection brings a request's first lines."""
CONNECTION_TIMEOUT = 10.0
"""Seconds after which a connection ends, whatever comes over it: an exchange takes one."""
LIMITS = Limits(
    connections=48,
    per_party=12,
    first_request=HEADER_TIMEOUT,
    lasts=CONNECTION_TIMEOUT,
    requests=4,  # an exchange takes two
)
FROZEN_AFTER = 2.0
"""Seconds after which a program whose loop does not turn counts as frozen; a camera may take a while to open."""
BEAT_PERIOD = 0.25
"""Seconds between two signs of life."""
PAIR = "this robot wants its key: ./stack pair ROBOT\n"

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class SignalingServer:
    """Serves routes to who has the key.

    Args:
        key: None: to this machine's own user alone.
    """

    def __init__(self, key: RobotKey | None = None) -> None:
        self._key = key
        self._challenges = Challenges()
        self._admission = Admission(LIMITS)

    def application(self, *routes: web.AbstractRouteDef) -> web.Application:
        """Return an application that passes on what may be asked; the handlers find the body read."""

        @web.middleware
        async def admit(request: web.Request, handler: Handler) -> web.StreamResponse:
            goes_on = self._admission.asked(request.transport)
            try:
                response = await self._admit(request, handler)
            except web.HTTPException as refusal:
                refusal.force_close()
                raise
            if not goes_on:
                response.force_close()
            return response

        application = web.Application(client_max_size=MAX_OFFER, middlewares=[admit])
        application.add_routes(routes)
        application.on_response_prepare.append(_without_names)
        return application

    async def serve(self, application: web.Application, address: str, port: int, ready: Callable[[str], None]) -> None:
        """Answer until cancelled.

        Args:
            address: Of one interface; "0.0.0.0" for all.
            port: 0 takes a free one.
            ready: Called with the URL.
        Raises:
            OSError: The port is taken or the address is not this machine's.
        """
        runner = web.AppRunner(
            application,
            access_log=None,
            logger=request_log(__name__),
            shutdown_timeout=1.0,
            keepalive_timeout=BODY_TIMEOUT,
            lingering_time=0.0,
            max_line_size=1024,
            max_field_size=1024,
            max_headers=MAX_HEADERS,
        )
        await runner.setup()
        beating = asyncio.ensure_future(_beat())
        try:
            assert runner.server is not None, "setup has made it"
            with listener(address, port, send_buffer=None) as listening:
                host, bound = listening.getsockname()[:2]
                ready(f"http://{f'[{host}]' if ':' in host else host}:{bound}")
                await self._admission.run(listening, runner.server)
        finally:
            beating.cancel()
            await runner.cleanup()

    async def _admit(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        if self._key is None:
            refusal = _refusal_without_key(request)
            if refusal is not None:
                return refusal
            await _read(request)
            self._prove(request)
            return await _handle(request, handler)
        credentials = credentials_in(request.headers.get("Authorization", ""))
        if credentials is None or not self._challenges.fresh(credentials.challenge, time.monotonic()):
            return self._ask_for_proof()
        body = await _read(request)
        asked = Request(request.method, request.raw_path, request.headers.get("Content-Type", ""), body)
        if not proven(self._key, asked, credentials):
            log.warning("%s has not the robot's key", request.remote)
            raise web.HTTPForbidden(text="this is not the robot's key: ./stack pair ROBOT\n")
        if not self._challenges.use(credentials.challenge, time.monotonic()):
            return self._ask_for_proof()
        self._prove(request)
        try:
            response = await _handle(request, handler)
        except web.HTTPException as refusal:
            response = web.Response(status=refusal.status, text=refusal.text)
        assert isinstance(response, web.Response), "routes answer with whole bodies"
        content = response.body if isinstance(response.body, bytes | bytearray) else b""
        answer = Answer(
            response.status,
            response.headers.get("Location", ""),
            response.headers.get("Content-Type", ""),
            bytes(content),
        )
        response.headers["Authentication-Info"] = answer_proof(self._key, credentials.proof, answer)
        return response

    def _ask_for_proof(self) -> web.Response:
        challenge = self._challenges.new(time.monotonic())
        return web.Response(status=401, text=PAIR, headers={"WWW-Authenticate": ask_for_proof(challenge)})

    def _prove(self, request: web.Request) -> None:
        self._admission.known(request.transport)


def local_address(request: web.Request) -> str:
    """Return the address of this machine at which the request came in.

    Raises:
        ConnectionError: Its connection is gone.
    """
    return _end(request, "sockname")


def remote_address(request: web.Request) -> str:
    """Return the address from which the request came. Errors as for `local_address`."""
    return _end(request, "peername")


def _end(request: web.Request, which: str) -> str:
    name = request.transport.get_extra_info(which) if request.transport else None
    if not name:
        raise ConnectionResetError("who asked is gone")
    address = ipaddress.ip_address(name[0].partition("%")[0])
    mapped = getattr(address, "ipv4_mapped", None)
    return str(mapped or address)


async def _read(request: web.Request) -> bytes:
    try:
        async with asyncio.timeout(BODY_TIMEOUT):
            return await request.read()
    except TimeoutError:
        raise web.HTTPRequestTimeout(text="the body takes too long\n") from None
    except web.RequestPayloadError:
        raise web.HTTPBadRequest(text="the body cannot be read\n") from None


async def _handle(request: web.Request, handler: Handler) -> web.StreamResponse:
    try:
        async with asyncio.timeout(ANSWER_TIMEOUT):
            return await handler(request)
    except TimeoutError:
        raise web.HTTPServiceUnavailable(text="the answer takes too long\n") from None


def _refusal_without_key(request: web.Request) -> web.Response | None:
    host = request.headers.get("Host", "").rpartition("]")[0] or request.headers.get("Host", "").partition(":")[0]
    if "Origin" in request.headers or not _is_address(host.strip("[]")):
        return web.Response(status=403, text="not for web pages\n")
    if request.transport is None:
        return web.Response(status=403)
    peer, own = (request.transport.get_extra_info(name) for name in ("peername", "sockname"))
    if ipaddress.ip_address(peer[0].partition("%")[0]).is_loopback and not local_users.is_own(peer, own):
        return web.Response(status=403, text="not for other users of this machine\n")
    return None


def _is_address(host: str) -> bool:
    """A name may lead anywhere: whose web page it is, its owner decides (DNS rebinding)."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return host in ("", "localhost")
    return True


async def _without_names(_request: web.Request, response: web.StreamResponse) -> None:
    """What runs here is nobody's business."""
    response.headers.pop("Server", None)


async def _beat() -> None:
    while True:
        heartbeat.beat(FROZEN_AFTER)
        await asyncio.sleep(BEAT_PERIOD)
