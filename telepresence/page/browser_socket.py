"""The way of one browser without WebRTC: a websocket carries its messages and, as JPEG files, the newest pictures.

    text      "KIND MESSAGE": the message of WebRTC's channel KIND; "seen" when the page has shown a picture
    binary    a picture: when it was taken [s since 1970], 8 bytes, most significant first; then the JPEG file

An <img> with a multipart stream would do for looking, but says neither when a picture was shown nor how old it is: the
page could not let go when the pictures stop. It answers each one instead, and at most `MOST_UNSEEN` are under way: a
slow network gets fewer pictures, not older ones.
"""

from __future__ import annotations

import asyncio
import struct
import time
from collections import deque
from collections.abc import Awaitable, Callable

from aiohttp import ClientConnectionResetError, WSMessage, WSMsgType, web

from telepresence.page.browser_messages import STATE_PERIOD, BrowserMessages, StationEnd
from telepresence.page.commands import LONGEST
from telepresence.page.pictures import Pictures

MOST_UNSEEN = 2
"""Pictures under way: one on the network while the page decodes the other."""
MOST_ANSWERS = 32
"""Answers that wait for the network; more are a page that does not read."""
CLOSING = 0.5
"""[s] for which the browser's goodbye is waited for."""
AT_ONCE = 16
"""Frames of one browser that are taken before it is everybody else's turn: the loop carries all their commands."""


class BrowserSocket:
    """Lives until the browser hangs up or falls silent.

    Args:
        pictures: What it looks at.
        end: What it leads to.
        ended: Called when the connection is over.
    """

    def __init__(
        self,
        pictures: Pictures,
        end: StationEnd,
        ended: Callable[[BrowserSocket], None],
    ) -> None:
        self.messages = BrowserMessages(end, self._put)
        """What the browser says and gets."""
        self._pictures, self._ended = pictures, ended
        self._socket = web.WebSocketResponse(
            timeout=CLOSING,
            autoping=False,  # aiohttp would answer as many as come, and count none
            max_msg_size=LONGEST + 64,
            compress=False,
            writer_limit=MOST_UNSEEN * 2**15,
        )
        self._newest: dict[str, str] = {}
        self._answers: deque[str] = deque(maxlen=MOST_ANSWERS)
        self._news, self._may_show = asyncio.Event(), asyncio.Semaphore(MOST_UNSEEN)
        self._unseen = 0
        self._shown_stamp: float | None = None
        self._over = False

    async def serve(self, request: web.Request) -> web.WebSocketResponse:
        """Answer a browser that asks for the websocket; returns when it is over."""
        try:
            await self._socket.prepare(request)
            async with asyncio.TaskGroup() as group:  # what fails ends the others
                tasks = [group.create_task(each) for each in (self._send(), self._show(), self._report())]
                await self._receive()
                if self.messages.flooding and request.transport is not None:
                    request.transport.abort()  # a goodbye would wait behind all that it has sent
                for task in tasks:
                    task.cancel()
        finally:
            await self.close()
        return self._socket

    async def close(self) -> None:
        """Hang up."""
        if self._over:
            return
        self._over = True
        self.messages.let_go()
        self._ended(self)
        if self._socket.prepared:
            await self._socket.close()

    async def _receive(self) -> None:
        """Take what the browser sends until it hangs up, or sends too much."""
        taken = 0
        async for message in self._socket:
            await self._take(message)
            if self.messages.flooding:
                return
            taken += 1
            if taken % AT_ONCE == 0:
                await asyncio.sleep(0)  # what has arrived already is read without a pause

    async def _take(self, message: WSMessage) -> None:
        kind, text = "", ""
        if message.type is WSMsgType.TEXT:
            kind, _, text = message.data.partition(" ")
        if kind != "seen" and message.type not in (WSMsgType.PING, WSMsgType.PONG):
            self.messages.receive(kind, text)
        elif self.messages.count():
            if message.type is WSMsgType.PING:
                await self._sent(self._socket.pong(message.data))
            elif kind == "seen" and self._unseen > 0:  # else a page of nobody's would have pictures piled up
                self._unseen -= 1
                self._may_show.release()

    async def _report(self) -> None:
        while not self.messages.silent:
            await asyncio.sleep(STATE_PERIOD)
            stamp = self._shown_stamp
            picture = None if stamp is None else [-1, round(time.time() - stamp, 4), stamp]
            self.messages.report({"picture": picture, "small": False})
        await self._socket.close()

    def _put(self, kind: str, text: str) -> None:
        """Send soon: answers in order, of the rest the newest of each kind."""
        if kind == "ask":
            self._answers.append(f"{kind} {text}")
        else:
            self._newest[kind] = f"{kind} {text}"
        self._news.set()

    async def _send(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            texts = [*self._answers, *self._newest.values()]
            self._answers.clear()
            self._newest.clear()
            for text in texts:
                if not await self._sent(self._socket.send_str(text)):
                    return

    async def _show(self) -> None:
        async with self._pictures.jpeg.viewer() as newer:
            while True:
                await self._may_show.acquire()
                picture = await newer()
                self._unseen += 1
                self._shown_stamp = picture.stamp
                if not await self._sent(self._socket.send_bytes(struct.pack(">d", picture.stamp) + picture.content)):
                    return

    async def _sent(self, sending: Awaitable[None]) -> bool:
        try:
            await sending
        except ClientConnectionResetError:  # the browser has gone: `_receive` ends
            return False
        return True
