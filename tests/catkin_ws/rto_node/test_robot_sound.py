"""The pilot's end of Robotino's sound against the robot's sound server, both without devices."""

from __future__ import annotations

import asyncio
import re
import socket
import threading
from collections.abc import Callable, Iterator

import aiortc
import pytest
from rto_bringup.onboard.sound_server import SILENT_PILOT, SoundServer, serve_sound
from rto_node.robot_sound import RobotSound

from telepresence.audio.webrtc_sound import LIFE_PERIOD


@pytest.fixture
def server() -> Iterator[str]:
    """Address of a robot's sound server."""
    loop, urls, listening = asyncio.new_event_loop(), [], threading.Event()

    def ready(url: str) -> None:
        urls.append(url)
        listening.set()

    work = loop.create_task(serve_sound(SoundServer("none", "none"), "127.0.0.1", 0, ready))

    def run() -> None:
        with pytest.raises(asyncio.CancelledError):
            loop.run_until_complete(work)
        loop.close()

    thread = threading.Thread(target=run)
    thread.start()
    assert listening.wait(30)
    yield urls[0].removeprefix("http://")
    loop.call_soon_threadsafe(work.cancel)
    thread.join(30)


@pytest.fixture
def pilot(server: str) -> Iterator[RobotSound]:
    pilot = RobotSound(server, lambda _: None)
    yield pilot
    pilot.close()


@pytest.fixture
def firewall(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """Nothing comes through but TCP, until it is undone: either end's packets go to a port where nobody answers."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as nobody:
        nobody.bind(("0.0.0.0", 0))
        port = nobody.getsockname()[1]
        described = aiortc.RTCPeerConnection.setRemoteDescription

        async def divert(peer: aiortc.RTCPeerConnection, description: aiortc.RTCSessionDescription) -> None:
            sdp = re.sub(r"(a=candidate:\S+ \d+ udp \d+ \S+ )\d+", rf"\g<1>{port}", description.sdp)
            await described(peer, aiortc.RTCSessionDescription(sdp, description.type))

        monkeypatch.setattr(aiortc.RTCPeerConnection, "setRemoteDescription", divert)
        yield monkeypatch


def test_where_no_packet_comes_through_nothing_is_said_to_be_live(
    firewall: pytest.MonkeyPatch, pilot: RobotSound, wait_until: Callable
) -> None:
    said = set()
    pilot.start()
    wait_until(lambda: said.add(pilot.problem) or pilot.connections >= 2, "it gives up, and dials again")
    assert "" not in said and any("UDP" in problem for problem in said) and pilot.frames == 0, said
    firewall.undo()
    wait_until(lambda: pilot.problem == "" and pilot.frames > 0, "sound")


def test_two_without_a_microphone_stay_connected(pilot: RobotSound, wait_until: Callable) -> None:
    pilot.start()
    enough = int(SILENT_PILOT / LIFE_PERIOD) + 12
    wait_until(lambda: pilot.frames > enough or pilot.connections > 1, "what keeps the connection alive")
    assert pilot.connections == 1 and pilot.problem == ""
