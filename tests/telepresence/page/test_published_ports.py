"""An answer names the host of a container, and WebRTC keeps to the ports that the host publishes."""

from __future__ import annotations

import asyncio
import socket

import pytest
from aiortc import RTCPeerConnection
from page_server import NoConversation

from telepresence.page import published_ports
from telepresence.page.browser_conversation import RobotConversation
from telepresence.page.browser_link import BrowserLink
from telepresence.page.browser_messages import StationEnd
from telepresence.page.pictures import Pictures
from telepresence.page.relays import Relays
from telepresence.video.images import LatestImage

OWN, HOST = "127.0.0.1", "127.0.0.9"


class Window:
    mine = False

    def let_go(self, now):
        pass


def pair_of_free_ports() -> range:
    while True:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as first:
            first.bind((OWN, 0))
            port = first.getsockname()[1]
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second:
                try:
                    second.bind((OWN, port + 1))
                except (OSError, OverflowError):
                    continue
        return range(port, port + 2)


def ports_offered(answer: str, address: str) -> set[int]:
    lines = [line.split() for line in answer.splitlines() if line.startswith("a=candidate:")]
    return {int(words[5]) for words in lines if words[4] == address}


def test_each_browser_gets_a_published_port_and_the_hosts_name_for_it():
    async def run():
        ports, links, browsers, given = pair_of_free_ports(), [], [], []
        for _ in range(3):  # one more than there are ports
            browsers.append(browser := RTCPeerConnection())
            for kind in ("video", "audio"):
                browser.addTransceiver(kind, direction="recvonly")
            await browser.setLocalDescription(await browser.createOffer())
            pictures, sound = Pictures(LatestImage(), lambda _: None), RobotConversation(NoConversation())
            links.append(BrowserLink(pictures, StationEnd(Window(), dict, None), lambda _: None, Relays(), sound))
            answer = await links[-1].answer(browser.localDescription.sdp, OWN, f"{HOST}:8443", ports)
            given.append((ports_offered(answer, OWN), ports_offered(answer, HOST)))
        for each in (*links, *browsers):
            await each.close()
        assert given[:2] == [({port}, {port}) for port in ports]
        assert given[2][0] and not given[2][0] & {*ports} and given[2][1] == set()

    asyncio.run(run())


def test_an_answer_of_a_checkout_stays_as_it_is():
    answer = f"a=candidate:{'0' * 32} 1 udp 2130706431 {OWN} 8444 typ host\r\n"
    assert (
        published_ports.with_host(answer, HOST, range(0))
        == published_ports.with_host(answer, "", range(8444, 8445))
        == answer
    )
    both = published_ports.with_host(answer, HOST, range(8444, 8445)).splitlines()
    assert both[0] == answer.strip()
    assert both[1] == f"a=candidate:{'0' * 31}h 1 udp 2130706430 {HOST} 8444 typ host"


@pytest.mark.parametrize("text, ports", [("", range(0)), ("8444-8459", range(8444, 8460)), ("8444", range(8444, 8445))])
def test_ports_are_the_environments(monkeypatch: pytest.MonkeyPatch, text: str, ports: range):
    monkeypatch.setenv(published_ports.VARIABLE, text)
    assert published_ports.published_ports() == ports


@pytest.mark.parametrize("text", ["many", "8459-8444", "0-5", "8444-70000", "-"])
def test_what_are_no_ports_is_said(monkeypatch: pytest.MonkeyPatch, text: str):
    monkeypatch.setenv(published_ports.VARIABLE, text)
    with pytest.raises(ValueError, match=published_ports.VARIABLE):
        published_ports.published_ports()


@pytest.mark.parametrize("host, address", [("localhost:8443", OWN), ("192.0.2.7:8443", "192.0.2.7"), ("x.invalid", "")])
def test_the_host_is_who_the_browser_asked(host: str, address: str):
    assert asyncio.run(published_ports.host_address(host)) == address
