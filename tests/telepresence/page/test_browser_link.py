"""The WebRTC connection of one browser, answered for a real offer."""

import asyncio
import os

import pytest
from aiortc import RTCPeerConnection
from page_server import NoConversation

from telepresence.page.browser_conversation import RobotConversation
from telepresence.page.browser_link import BrowserLink
from telepresence.page.browser_messages import StationEnd
from telepresence.page.pictures import Pictures
from telepresence.page.relays import Relays
from telepresence.video.images import LatestImage


class Window:
    mine = False

    def let_go(self, now):
        pass


def test_one_that_is_given_up_while_it_is_answered_leaves_nothing_behind():
    async def run():
        browser = RTCPeerConnection()
        for kind in ("video", "audio"):
            browser.addTransceiver(kind, direction="recvonly")
        await browser.setLocalDescription(await browser.createOffer())
        answered, opened, turns = False, None, -1
        while not answered:  # it is given up at each of the answer's steps
            turns += 1
            ended = []
            pictures, sound = Pictures(LatestImage(), lambda _: None), RobotConversation(NoConversation())
            link = BrowserLink(pictures, StationEnd(Window(), dict, None), ended.append, Relays(), sound)
            answer = asyncio.ensure_future(link.answer(browser.localDescription.sdp, "127.0.0.1"))
            for _ in range(turns):  # of the event loop
                await asyncio.sleep(0)
            answered = answer.done()
            await link.close()
            if answered:
                await answer
            else:
                with pytest.raises(ValueError, match="given up"):
                    await answer
            assert pictures.video.viewers == 0 and ended == [link]
            opened = opened or len(os.listdir("/proc/self/fd"))
            assert len(os.listdir("/proc/self/fd")) == opened
        assert turns > 3
        await browser.close()

    asyncio.run(run())


def test_one_whose_offer_is_none_is_over():
    async def run():
        ended = []
        pictures, sound = Pictures(LatestImage(), lambda _: None), RobotConversation(NoConversation())
        link = BrowserLink(pictures, StationEnd(Window(), dict, None), ended.append, Relays(), sound)
        with pytest.raises(ValueError, match="something else"):
            await link.answer("m=text 9", "127.0.0.1")
        assert ended == [link]

    asyncio.run(run())
