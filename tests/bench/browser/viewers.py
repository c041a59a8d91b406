"""People who look: `python viewers.py URL INVITATION COUNT` connects so many browsers, as the page does, but
without decoding; prints "ready" when everybody gets pictures, and goes when its standard input ends."""

from __future__ import annotations

import asyncio
import json
import secrets
import sys
import time
from queue import Queue

import aiohttp
import aiortc.rtcrtpreceiver
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

LIFE = 0.25
"""Seconds between two signs of life."""


def decode_nothing(_loop: asyncio.AbstractEventLoop, pictures: Queue, *_others: object) -> None:
    """In place of aiortc's thread: what the viewer does with its pictures is not the station's work."""
    while pictures.get() is not None:
        pass


class Viewer:
    def __init__(self, url: str, name: str, invitation: str) -> None:
        self._url, self._name, self._invitation = url, name, invitation
        self._peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        late = {"ordered": False, "maxRetransmits": 0}
        self._drive, self._state = (self._peer.createDataChannel(name, **late) for name in ("drive", "state"))
        self._peer.createDataChannel("ask")
        self.looks = asyncio.Event()

    async def come(self, session: aiohttp.ClientSession) -> None:
        self._peer.addTransceiver("video", direction="recvonly")
        await self._peer.setLocalDescription(await self._peer.createOffer())
        await self._post(session, "enter", {"name": self._name, "invitation": self._invitation})
        page, sdp = secrets.token_hex(8), self._peer.localDescription.sdp
        offer = {"robot": "Pepper", "page": page, "attempt": 1, "sdp": sdp}
        answer = await self._post(session, "offer", offer)
        self._state.on("message", lambda text: self.looks.set() if json.loads(text)["picture"] else None)
        await self._peer.setRemoteDescription(RTCSessionDescription(answer["sdp"], "answer"))

    async def live(self) -> None:
        number = 0
        while True:
            await asyncio.sleep(LIFE)
            if self._drive.readyState == "open":
                number += 1
                self._drive.send(json.dumps({"n": number, "t": time.monotonic(), "v": None, "hold": "I only look."}))

    async def _post(self, session: aiohttp.ClientSession, path: str, fields: dict) -> dict:
        async with session.post(self._url + path, json=fields, ssl=False) as answer:
            words = await answer.json()
            if answer.status != 200:
                raise RuntimeError(f"{path}: {words}")
            return words


async def look(url: str, invitation: str, count: int) -> None:
    viewers, lives, sessions = [], [], []
    for number in range(count):
        session = aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True))
        sessions.append(session)
        viewers.append(Viewer(url, f"viewer {number}", invitation))
        await viewers[-1].come(session)
        lives.append(asyncio.ensure_future(viewers[-1].live()))
    await asyncio.gather(*(viewer.looks.wait() for viewer in viewers))
    print("ready", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    for session in sessions:
        await session.close()


if __name__ == "__main__":
    aiortc.rtcrtpreceiver.decoder_worker = decode_nothing
    asyncio.run(look(sys.argv[1], sys.argv[2], int(sys.argv[3])))
