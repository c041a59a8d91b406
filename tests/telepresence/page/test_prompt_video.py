"""Every packet of pictures asks the browser not to wait: by a real connection of two ends."""

import asyncio

import numpy as np
from aiortc import RTCPeerConnection, RTCSessionDescription
from aiortc.rtp import RtpPacket, unpack_header_extensions
from page_server import NoConversation

from telepresence.page.browser_conversation import RobotConversation
from telepresence.page.browser_link import BrowserLink
from telepresence.page.browser_messages import StationEnd
from telepresence.page.pictures import Pictures
from telepresence.page.prompt_video import PLAYOUT_DELAY
from telepresence.page.relays import Relays
from telepresence.video.images import LatestImage


class Window:
    mine = False

    def let_go(self, now):
        pass


def extension_id(sdp):
    line = next(line for line in sdp.splitlines() if line.startswith("a=extmap:") and PLAYOUT_DELAY in line)
    return int(line.removeprefix("a=extmap:").split()[0])


def test_packets_carry_a_playout_delay_of_nothing(monkeypatch):
    packets = []
    serialize = RtpPacket.serialize

    def kept(packet, extensions):
        data = serialize(packet, extensions)
        packets.append(data)
        return data

    monkeypatch.setattr(RtpPacket, "serialize", kept)

    async def run():
        source = LatestImage()
        sound = RobotConversation(NoConversation())
        link = BrowserLink(
            Pictures(source, lambda _: None), StationEnd(Window(), dict, None), lambda _: None, Relays(), sound
        )
        browser = RTCPeerConnection()
        browser.addTransceiver("video", direction="recvonly")
        await browser.setLocalDescription(await browser.createOffer())
        answer = await link.answer(browser.localDescription.sdp, "127.0.0.1")
        await browser.setRemoteDescription(RTCSessionDescription(answer, "answer"))
        for level in range(200):
            source.put(np.full((180, 160), level, np.uint8))
            await asyncio.sleep(0.02)
            if packets:
                break
        await link.close()
        await browser.close()
        return extension_id(answer)

    number = asyncio.run(run())
    data = packets[0]
    profile, length = int.from_bytes(data[12:14], "big"), 4 * int.from_bytes(data[14:16], "big")
    extensions = dict(unpack_header_extensions(profile, data[16 : 16 + length]))
    assert extensions[number] == bytes(3) and len(extensions) == 3, "beside those of aiortc"
