"""The way without WebRTC: a real server, asked by a real client."""

import asyncio
import json
import struct
import time

import aiohttp
import cv2
import numpy as np
import pytest
from aiohttp import WSMsgType, web

from telepresence.page import browser_messages
from telepresence.page.browser_messages import StationEnd
from telepresence.page.browser_socket import MOST_UNSEEN, BrowserSocket
from telepresence.page.pictures import Pictures
from telepresence.video.images import LatestImage

NEWEST = round(time.time()) + 1000.0
"""When the pictures were taken [s since 1970], but for their level: later than any test sees."""


class Window:
    mine = True

    def __init__(self):
        self.driven, self.let_go_at = [], []

    def drive(self, message, now):
        self.driven.append(message.velocity)
        return True

    def let_go(self, now):
        self.let_go_at.append(now)

    def ask(self, message):
        pass


class Robot:
    def __init__(self):
        self.source, self.watched, self.ended = LatestImage(), [], []
        self.pictures = Pictures(self.source, self.watched.append)
        self.window = Window()
        self.state = lambda: {"pilot": ""}

    async def handle(self, request):
        socket = BrowserSocket(self.pictures, StationEnd(self.window, lambda: self.state(), None), self.ended.append)
        return await socket.serve(request)

    def show(self, level):
        planes = np.full((180, 160), level, np.uint8)
        planes[120:] = 128  # grey
        self.source.put(planes, NEWEST + level)


class Page:
    def __init__(self, socket):
        self.socket = socket

    async def picture(self):
        while True:
            message = await asyncio.wait_for(self.socket.receive(), 5.0)
            if message.type is WSMsgType.BINARY:
                pixels = cv2.imdecode(np.frombuffer(message.data[8:], np.uint8), cv2.IMREAD_GRAYSCALE)
                return struct.unpack(">d", message.data[:8])[0], pixels

    async def text(self, kind):
        while True:
            message = await asyncio.wait_for(self.socket.receive(), 5.0)
            if message.type is WSMsgType.TEXT and message.data.startswith(kind):
                return json.loads(message.data.partition(" ")[2])

    async def ends(self):
        while (await asyncio.wait_for(self.socket.receive(), 5.0)).type not in (WSMsgType.CLOSED, WSMsgType.CLOSE):
            pass


@pytest.fixture
def with_page():
    def run(scenario):
        async def serve():
            robot = Robot()
            application = web.Application()
            application.add_routes([web.get("/ws", robot.handle)])
            runner = web.AppRunner(application, access_log=None)
            await runner.setup()
            await web.TCPSite(runner, "127.0.0.1", 0).start()
            url = f"http://127.0.0.1:{runner.addresses[0][1]}/ws"
            async with aiohttp.ClientSession() as session, session.ws_connect(url) as socket:
                await scenario(robot, Page(socket))
            await runner.cleanup()

        asyncio.run(serve())

    return run


def test_pictures_come_with_the_time_when_they_were_taken(with_page):
    async def scenario(robot, page):
        robot.show(50)
        stamp, pixels = await page.picture()
        assert (
            stamp == NEWEST + 50 and pixels.shape == (120, 160) and abs(int(pixels[5, 5]) - 39) < 9
        )  # 50 in video's range
        assert robot.watched == [True]

    with_page(scenario)


def test_who_shows_nothing_gets_no_more_and_then_the_newest(with_page):
    async def scenario(robot, page):
        for level in range(30, 30 + 5 * MOST_UNSEEN, 5):
            robot.show(level)
            await page.picture()
        for level in range(100, 110):
            robot.show(level)
            await page.text("state")
        await page.socket.send_str("seen")
        assert (await page.picture())[0] == NEWEST + 109

    with_page(scenario)


def test_commands_are_answered_and_the_state_is_told(with_page):
    async def scenario(robot, page):
        await page.socket.send_str('drive {"n": 7, "t": 1.0, "v": [0.2, 0, 0], "hold": ""}')
        assert await page.text("drive") == {"n": 7} and robot.window.driven == [(0.2, 0.0, 0.0)]
        assert (await page.text("state"))["pilot"] == ""

    with_page(scenario)


@pytest.mark.parametrize("end", ["hangs up", "is silent", "sends a giant", "gets what fails"])
def test_at_the_end_the_robot_is_let_go_and_nobody_looks(with_page, monkeypatch, end):
    if end == "is silent":
        monkeypatch.setattr(browser_messages, "SILENCE", 0.2)

    async def scenario(robot, page):
        robot.show(50)
        await page.picture()
        if end == "hangs up":
            await page.socket.close()
        elif end == "sends a giant":
            await page.socket.send_str("drive " + "x" * 100_000)
        elif end == "gets what fails":
            robot.state = lambda: {"pilot": b"no JSON"}
        if end != "hangs up":
            await page.ends()
        deadline = time.monotonic() + 5.0
        while not robot.ended and time.monotonic() < deadline:
            await asyncio.sleep(0.01)
        assert len(robot.window.let_go_at) == 1 and robot.watched == [True, False] and robot.window.driven == []

    with_page(scenario)


def test_a_page_that_says_more_than_it_has_seen_piles_up_nothing(with_page):
    async def scenario(robot, page):
        for _ in range(50):
            await page.socket.send_str("seen")
        await page.socket.send_str('drive {"n": 1, "t": 1.0, "v": null, "hold": ""}')
        await page.text("drive")
        for level in range(100, 120):
            robot.show(level)
            await asyncio.sleep(0.005)
        assert (await page.text("state")) and robot.source.peek().sequence == 20
        got = 0
        deadline = time.monotonic() + 0.3
        while (left := deadline - time.monotonic()) > 0:
            try:
                message = await asyncio.wait_for(page.socket.receive(), left)
            except TimeoutError:
                break
            got += message.type is WSMsgType.BINARY
        assert got <= MOST_UNSEEN

    with_page(scenario)
