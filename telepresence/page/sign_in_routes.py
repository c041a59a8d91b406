"""Coming in and going out, over HTTP.

    POST /enter         {"name": ..., "password": ...} or {"name": ..., "invitation": TOKEN}
                                                       200 and a cookie; 403 with a sentence; 429 after too many tries
    POST /leave         ends the sign-in
    GET /me             who has signed in, and which robots there are; 401 for nobody, with a sentence, whether a
                        password is needed, why the sign-in has ended, and which other way in there is
    POST /invite        {"role": "pilot" | "watcher", "hours": 2, "once": false}        the link, and its QR code
    GET /invitations    those that hold
    POST /withdraw      {"id": ...}

Pilots with an account invite; guests and watchers do not. Tries are limited by address and by link, so that guessing
takes for ever; whoever is in already notices nothing of it.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import math
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from aiohttp import web

from telepresence.page import qr_code
from telepresence.page.attempts import Attempts, network
from telepresence.page.audit import Audit
from telepresence.page.entrance import Entrance
from telepresence.page.proxy import Proxy, way_of
from telepresence.page.sign_ins import LIFE, SignIn, SignIns
from telepresence.teleop.accounts import LONGEST_PAUSE, LONGEST_QUEUE, QueueFull, Try, UserError, is_guest_name
from telepresence.teleop.invitations import Invitation, may_invite
from telepresence.teleop.lease_messages import Account

log = logging.getLogger(__name__)

MOST_AT_ONCE = 2
"""Passwords that are checked at the same time: each takes 0.1 s of a core and some memory."""
MOST_WAITING = 16
"""Further ones that wait for that."""
MOST_PATIENT, MOST_PATIENT_OF_ONE = 64, 2
"""Tries that wait for their turn, after wrong ones for the same name: in all, and of one address."""
AT_ONCE = 0.5
"""[s] for which a try may wait and counts as one that does not: less than after any wrong one."""
REVISED = 0.5
"""[s] between two looks at whether those who are in still may be."""
Found = TypeVar("Found")
_COOKIE = {"secure": True, "httponly": True, "samesite": "Strict"}


class SignInRoutes:
    """Who is in. Belongs to one event loop.

    Args:
        left: Called when a sign-in has ended: closes what it has open.
        robots: What there is to see, for whoever comes in.
        proxy: Through which browsers may come.
    """

    def __init__(
        self,
        entrance: Entrance,
        sign_ins: SignIns,
        audit: Audit,
        robots: list[str],
        left: Callable[[SignIn], Awaitable[None]],
        proxy: Proxy | None = None,
    ) -> None:
        self._proxy = proxy
        self._entrance, self._sign_ins, self._audit = entrance, sign_ins, audit
        self._robots, self._left = robots, left
        self._attempts = Attempts()
        # Threads of their own: each keeps the memory of one check.
        self._checkers = ThreadPoolExecutor(MOST_AT_ONCE, thread_name_prefix="passwords")
        self._waiting = 0
        self._patient: Counter[str] = Counter()

    def routes(self) -> list[web.RouteDef]:
        """Return what aiohttp serves."""
        return [
            web.post("/enter", self._enter),
            web.post("/leave", self._leave),
            web.get("/me", self._me),
            web.post("/invite", self._invite),
            web.get("/invitations", self._invitations),
            web.post("/withdraw", self._withdraw),
        ]

    async def recognize(self, request: web.Request) -> None:
        """Look whether who comes back after a restart of this program still may be in."""
        cookie = self._cookie(request)
        if not cookie or not self._sign_ins.returns(cookie):
            return
        sign_in = self._sign_ins.find(cookie, time.time())
        if sign_in is not None:
            await self._send_away([sign_in])

    def who(self, request: web.Request) -> SignIn:
        """Return whose request this is. Raises HTTPUnauthorized."""
        sign_in = self.sign_in(request)
        if sign_in is None:
            reason = self._sign_ins.why_ended(self._cookie(request))
            raise web.HTTPUnauthorized(reason=reason or "Sign in first.")
        return sign_in

    def sign_in(self, request: web.Request) -> SignIn | None:
        """Return whose request this is, if anybody's."""
        return self._sign_ins.find(self._cookie(request), time.time())

    def network(self, request: web.Request) -> str:
        """Return from where it came, as tries are counted."""
        return network(self._client(request))

    def _cookie(self, request: web.Request) -> str:
        return request.cookies.get(way_of(request, self._proxy).cookie, "")

    def _client(self, request: web.Request) -> str:
        return way_of(request, self._proxy).client

    def holds(self, sign_in: SignIn) -> bool:
        """Return whether this sign-in has not ended."""
        return self._sign_ins.holds(sign_in)

    async def revise(self) -> None:
        """Send those away who may not be in any more; for ever."""
        while True:
            await asyncio.sleep(REVISED)
            try:
                await self._send_away(self._sign_ins.all())
            except UserError as error:
                log.error("%s", error)
            for sign_in in self._sign_ins.take_lapsed(time.time()):
                await self._let_out(sign_in, "")  # what it has open ends with it
            self._sign_ins.save_now_and_then(time.time())

    async def _send_away(self, present: list[SignIn]) -> None:
        outdated = await asyncio.to_thread(self._entrance.outdated, [one.account for one in present])
        for sign_in in present:
            if sign_in.account.name in outdated:
                await self._end(sign_in, outdated[sign_in.account.name])

    def close(self) -> None:
        """The program ends; who is in stays so."""
        self._checkers.shutdown(wait=False, cancel_futures=True)
        self._sign_ins.save(time.time())
        self._audit.close()

    async def _enter(self, request: web.Request) -> web.StreamResponse:
        fields = await read_fields(request, {"name": str, "password": str}, {"name": str, "invitation": str})
        way = way_of(request, self._proxy)
        address = network(way.client)
        counted = [f"address {address}"]
        if "invitation" in fields:
            digest = hashlib.sha256(fields["invitation"].encode("utf-8", "surrogatepass")).hexdigest()
            counted.append(f"link {digest[:16]}")
        wait = max(self._attempts.wait(key, time.monotonic()) for key in counted)
        if wait or self._waiting >= MOST_WAITING:
            self._audit.sample("refused, too many tries", address=address)
            reason = f"Too many tries. Wait {wait:.0f} s." if wait else "Too many people try to come in."
            return refuse(429, reason, wait or 1.0)
        for key in counted:
            self._attempts.note(key, time.monotonic())
        try:
            account, invitation = await self._admit(fields, way.client)
        except QueueFull as error:
            self._audit.sample("refused, too many tries", address=address)
            return refuse(429, str(error), LONGEST_PAUSE)
        except UserError as error:
            self._audit.sample("refused at the entrance", name=fields["name"][:64], address=address)
            return refuse(403, str(error))
        for key in counted:
            self._attempts.forgive(key, time.monotonic())
        cookie, sign_in = self._sign_ins.begin(account, time.time())
        self._audit.note(
            "came in", name=account.name, role=account.role, address=address, browser=sign_in.name,
            invitation=invitation.id if invitation else "",
        )  # fmt: skip
        response = web.json_response(self._about(account))
        response.set_cookie(way.cookie, cookie, path=way.path, max_age=round(LIFE), **_COOKIE)  # type: ignore[arg-type]
        return response

    async def _admit(self, fields: dict[str, str], address: str) -> tuple[Account, Invitation | None]:
        if "invitation" in fields:
            return await asyncio.to_thread(self._entrance.accept, fields["invitation"], fields["name"])
        name, password = fields["name"], fields["password"]
        counted = await self._wait_for_turn(name, password, network(address))
        return await self._on_checker(self._entrance.admit, name, password, address, counted), None

    async def _on_checker(self, work: Callable[..., Found], *words: object) -> Found:
        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._checkers, work, *words)
        finally:
            self._waiting -= 1

    async def _wait_for_turn(self, name: str, password: str, address: str) -> Try:
        """Return once a try may be decided, without a thread: whoever tries another name needs them. Raises UserError.

        Tries of an address that waits already are refused if they would wait, too: they would be all of a name's queue.
        """
        patient = self._patient[address] < MOST_PATIENT_OF_ONE and self._patient.total() < MOST_PATIENT
        self._patient[address] += 1  # several at the same moment are several
        try:
            longest = LONGEST_QUEUE if patient else AT_ONCE
            counted = await self._on_checker(self._entrance.count_try, name, password, longest)
            await asyncio.sleep(counted.wait)
        finally:
            self._patient[address] -= 1
            self._patient += Counter()  # forgets those of whom none waits
        return counted

    async def _leave(self, request: web.Request) -> web.StreamResponse:
        sign_in = self.who(request)
        await self._end(sign_in, "")
        if is_guest_name(sign_in.account.name):
            await asyncio.to_thread(self._entrance.invitations.leave, sign_in.account.name)
        response = web.json_response({})
        way = way_of(request, self._proxy)
        response.del_cookie(way.cookie, path=way.path, **_COOKIE)  # type: ignore[arg-type]
        return response

    async def _end(self, sign_in: SignIn, reason: str) -> None:
        if self._sign_ins.end(sign_in, time.time(), reason):  # not by two at once: who leaves, and who looks after them
            await self._let_out(sign_in, reason)

    async def _let_out(self, sign_in: SignIn, reason: str) -> None:
        self._audit.note("left", name=sign_in.account.name, browser=sign_in.name, reason=reason)
        await self._left(sign_in)

    async def _me(self, request: web.Request) -> web.StreamResponse:
        try:
            return web.json_response(self._about(self.who(request).account))
        except web.HTTPUnauthorized as error:
            fields = {"reason": error.reason, "password": self._entrance.asks(self._client(request))}
            ended = self._sign_ins.why_ended(self._cookie(request))
            fields |= {name: words for name, words in (("ended", ended), ("hint", self._entrance.hint)) if words}
            return web.json_response(fields, status=error.status)

    async def _invite(self, request: web.Request) -> web.StreamResponse:
        host = self._host(request)
        fields = await read_fields(request, {"role": str, "hours": float, "once": bool})
        invitations = self._entrance.invitations
        try:
            made, link = await asyncio.to_thread(
                invitations.invite, fields["role"], 3600.0 * fields["hours"], fields["once"], host.account.name
            )
        except UserError as error:
            return refuse(400, str(error))
        self._audit.note("invited", name=host.account.name, invitation=made.id, role=made.role, once=made.once)
        rows = await asyncio.to_thread(qr_code.rows, link)
        return web.json_response({"link": link, "qr": rows} | _shown(made))

    async def _invitations(self, request: web.Request) -> web.StreamResponse:
        self._host(request)
        found = await asyncio.to_thread(self._entrance.invitations.all)
        return web.json_response({"invitations": [_shown(invitation) for invitation in found]})

    async def _withdraw(self, request: web.Request) -> web.StreamResponse:
        host = self._host(request)
        fields = await read_fields(request, {"id": str})
        try:
            invitation = await asyncio.to_thread(self._entrance.invitations.withdraw, fields["id"])
        except UserError as error:
            return refuse(404, str(error))
        self._audit.note("withdrew", name=host.account.name, invitation=invitation.id)
        return web.json_response({})

    def _host(self, request: web.Request) -> SignIn:
        """Return who invites. Raises HTTPForbidden."""
        sign_in = self.who(request)
        if not may_invite(sign_in.account):
            self._audit.sample("refused to invite", name=sign_in.account.name)
            raise web.HTTPForbidden(reason="Only pilots with an account invite.")
        return sign_in

    def _about(self, account: Account) -> dict[str, Any]:
        return {
            "name": account.name,
            "role": account.role,
            "robots": self._robots,
            "invites": may_invite(account),
        }


def _shown(invitation: Invitation) -> dict[str, Any]:
    return {
        "id": invitation.id,
        "role": invitation.role,
        "once": invitation.once,
        "left": round(invitation.ends - time.time()),
        "maker": invitation.maker,
        "used": invitation.used,
    }


async def read_fields(request: web.Request, *shapes: dict[str, type]) -> dict[str, Any]:
    """Return the fields of a body that has one of these shapes: a name and a type each; float takes whole numbers, too.

    Raises:
        HTTPBadRequest: It has none of them.
    """
    try:
        fields = await request.json()
    except (ValueError, RecursionError):
        fields = None
    for shape in shapes:
        if isinstance(fields, dict) and set(fields) == set(shape):
            if all(type(fields[name]) in ((int, float) if kind is float else (kind,)) for name, kind in shape.items()):
                return fields
    names = " or ".join(", ".join(sorted(shape)) for shape in shapes)
    raise web.HTTPBadRequest(reason=f"The body must be JSON with {names}.")


def refuse(status: int, reason: str, wait: float = 0.0) -> web.Response:
    """Return an answer that says why not, and after how many seconds it might be another one; 0 for never."""
    headers = {"Retry-After": f"{math.ceil(wait)}"} if wait else None
    return web.json_response({"reason": reason}, status=status, headers=headers)
