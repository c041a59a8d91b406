"""The pilot's side of offers by HTTP to a robot's camera sender and sound server. No ROS.

    POST URL            our offer, application/sdp   201 and the answer; Location: our place
    DELETE LOCATION     we leave

With the robot's key, which `./stack pair ROBOT` brought, both sides prove that they have it
(`telepresence.security.signed_requests`). Without one nothing is sent to any robot but one on this machine: whoever
answers at its address could be anybody.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
from collections.abc import Callable
from typing import TypeVar
from urllib.parse import urlsplit

import aiohttp
import yarl
from aiortc import RTCPeerConnection, RTCSessionDescription

from telepresence.security.robot_key import RobotKey, is_loopback
from telepresence.security.signed_requests import Answer, Request, answer_proven, authorization, challenge_in
from telepresence.video.foreign_sdp import checked
from telepresence.video.webrtc import address_towards, on_address

T = TypeVar("T")
SDP = "application/sdp"
MAX_ANSWER = 64 * 1024
"""Bytes."""
MAX_REASON = 200
"""Characters that are shown of what a robot says."""
_LOCATION = re.compile(r"/[a-z]{1,16}/[0-9A-Za-z]{1,64}", re.ASCII)


class Refused(RuntimeError):
    """There is no agreement with the robot; the text says why and what to do."""


class SignalingClient:
    """Makes offers to one service of one robot.

    Args:
        url: Where offers go.
        what: What the service is, for messages: "camera sender".
        timeout: Seconds for each answer.
    """

    def __init__(self, url: str, what: str, timeout: float) -> None:
        self._url = url
        self._what = what
        self._timeout = timeout
        parts = urlsplit(url)
        self._host, self._port = str(parts.hostname), int(parts.port or 0)

    def session(self) -> aiohttp.ClientSession:
        """Return a session for the other methods; closed by its owner."""
        return aiohttp.ClientSession(
            timeout=aiohttp.ClientTimeout(total=self._timeout),
            auto_decompress=False,
            cookie_jar=aiohttp.DummyCookieJar(),
        )

    async def exchange(
        self, session: aiohttp.ClientSession, peer: RTCPeerConnection, query: dict[str, str] | None = None
    ) -> str | None:
        """Offer what the connection is to carry, and give it the answer; our place at the robot.

        Raises:
            Refused: The robot will not, or there is no key, or the answer is not from who has it.
            OSError, TimeoutError, aiohttp.ClientError: The robot does not answer.
        """
        own, robot, key = await self._in_thread(
            lambda: (address_towards(self._host, self._port), self._robot(), self._key())
        )
        with on_address(own):
            await peer.setLocalDescription(await peer.createOffer())
        offer = peer.localDescription.sdp.encode()
        url = yarl.URL(self._url).update_query(query or {})
        answer = await self._ask(session, key, "POST", url, offer)
        if answer.status != 201:
            raise Refused(f"the {self._what} at {self._url} refuses: {_plain(answer.body)}")
        try:
            description = checked(answer.body.decode(errors="replace"), *robot)
            await peer.setRemoteDescription(RTCSessionDescription(description, "answer"))
        except Exception as error:  # aiortc parses with asserts and indices
            raise Refused(
                f"the answer of the {self._what} at {self._url} is invalid: {error!r}"[:MAX_REASON]
            ) from error
        return answer.location if _LOCATION.fullmatch(answer.location) else None

    async def leave(self, session: aiohttp.ClientSession, location: str | None) -> None:
        """Give the place back; without success where the robot is gone, which notices the loss anyway."""
        if location is None:
            return
        with contextlib.suppress(Refused, aiohttp.ClientError, TimeoutError, OSError):
            key = await self._in_thread(self._key)
            await self._ask(session, key, "DELETE", yarl.URL(self._url).with_path(location))

    def _robot(self) -> set[str]:
        """The addresses of the robot's name."""
        return {str(found[4][0]).partition("%")[0] for found in socket.getaddrinfo(self._host, self._port)}

    def _key(self) -> RobotKey | None:
        """The robot's key. Raises Refused where one is needed."""
        try:
            key = RobotKey.of(self._host)
        except ValueError as error:
            raise Refused(str(error)) from None
        if key is None and not is_loopback(self._host):
            raise Refused(f"there is no key for the robot at {self._host}: ./stack pair {self._host}")
        return key

    async def _ask(
        self, session: aiohttp.ClientSession, key: RobotKey | None, method: str, url: yarl.URL, body: bytes = b""
    ) -> Answer:
        """Make a request; the answer, which is the robot's where there is a key."""
        request = Request(method, url.raw_path_qs, SDP if body else "", body)
        headers, proof = {"Content-Type": SDP} if body else {}, b""
        if key is not None:
            headers["Authorization"], proof = authorization(key, request, await self._challenge(session, url))
        async with session.request(
            method, url, data=body or None, headers=headers, allow_redirects=False, skip_auto_headers=["Content-Type"]
        ) as response:
            location, kind = (response.headers.get(name, "") for name in ("Location", "Content-Type"))
            answer = Answer(response.status, location, kind, await _read(response))
            if key is None and response.status == 401:
                raise Refused(f"the robot at {self._host} wants its key: ./stack pair {self._host}")
            if key is not None and response.status in (401, 403):
                raise Refused(f"the robot at {self._host} has another key than this machine: ./stack pair {self._host}")
            if key is not None and not answer_proven(
                key, proof, answer, response.headers.get("Authentication-Info", "")
            ):
                raise Refused(
                    f"what answers at {self._url} does not prove that it is the robot: if the robot has a new key, "
                    f"./stack pair {self._host}"
                )
            return answer

    async def _challenge(self, session: aiohttp.ClientSession, url: yarl.URL) -> str:
        async with session.get(url.with_query(None), allow_redirects=False) as response:
            challenge = challenge_in(response.headers.get("WWW-Authenticate", ""))
            await _read(response)
        if response.status != 401 or challenge is None:
            raise Refused(
                f"what answers at {self._url} asks for no proof: it is not the robot, or runs without its key"
            )
        return challenge

    async def _in_thread(self, question: Callable[[], T]) -> T:
        """Ask for what may take seconds: a name's address, a file."""
        return await asyncio.wait_for(asyncio.get_running_loop().run_in_executor(None, question), self._timeout)


async def _read(response: aiohttp.ClientResponse) -> bytes:
    body = bytearray()
    async for part in response.content.iter_chunked(4096):
        body += part
        if len(body) > MAX_ANSWER:
            raise Refused(f"the answer of {response.url} is longer than {MAX_ANSWER} bytes")
    return bytes(body)


def _plain(text: bytes) -> str:
    """Return the begin of what an outsider wrote, without what would move a terminal's cursor."""
    return "".join(each if each.isprintable() else " " for each in text.decode(errors="replace")[:MAX_REASON]).strip()
