"""Subscribing to the robot's microphones, with a robot that answers late, never, or with a refusal."""

from __future__ import annotations

import contextlib
import itertools
import os
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from naoqi_clients import DEFAULT, client_library
from naoqi_driver.connection import Address, Connection
from telepresence_1.microphone_stream import FIRST_PAUSE, MicrophoneStream

qi = client_library(DEFAULT)
SAMPLES = 160


class AudioDevice:
    """ALAudioDevice as far as microphones go. `next` says what becomes of the next calls of a method: they are
    "refused" and not done, "lost" without being done, or done and "unanswered"."""

    def __init__(self) -> None:
        self.subscribed: list[str] = []
        self.asked: list[float] = []
        """When it was asked to subscribe somebody [s, monotonic]."""
        self.next: dict[str, list[str]] = {"subscribe": [], "unsubscribe": []}
        self._promises: list[Any] = []

    def setClientPreferences(self, name: str, rate: int, channels: int, deinterleaved: int) -> None:
        pass

    def subscribe(self, name: str) -> qi.Future:
        self.asked.append(time.monotonic())
        return self._answer("subscribe", lambda: self.subscribed.append(name))

    def unsubscribe(self, name: str) -> qi.Future:
        return self._answer("unsubscribe", lambda: self.subscribed.remove(name))

    def _answer(self, method: str, act: Callable[[], None]) -> qi.Future:
        fault = self.next[method].pop(0) if self.next[method] else ""
        promise = qi.Promise()
        if fault == "refused":
            promise.setError("not now")
        if fault in ("", "unanswered"):
            try:
                act()
            except ValueError:
                promise.setError("has not subscribed")
                return promise.future()
        if fault == "":
            promise.setValue(None)
        self._promises.append(promise)
        return promise.future()


@pytest.fixture
def device(naoqi) -> AudioDevice:
    device = AudioDevice()
    naoqi.register("ALAudioDevice", device)
    return device


class Ear:
    """A stream, and the first sample of every block that came out of it."""

    def __init__(self, naoqi: Any, connection: Connection) -> None:
        self._naoqi = naoqi
        self.blocks: list[int] = []
        self.stream = MicrophoneStream(connection, lambda block, *_: self.blocks.append(int(block[0, 0])), "front")

    def registered(self) -> list[str]:
        """Our services in the robot's directory."""
        names = [info["name"] for info in self._naoqi.session.services()]
        return [name for name in names if name.startswith("PilotsEars")]

    def send(self, name: str, value: int) -> None:
        """Be the robot that sends a block to a name; return when it has been taken or left out."""
        block = np.full(SAMPLES, value, "<i2").tobytes()
        self._naoqi.session.service(name).processRemote(1, SAMPLES, [0, 0], block)


@pytest.fixture
def ear(naoqi, device) -> Iterator[Ear]:
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as connection:
        assert connection.wait_connected(10.0)
        ear = Ear(naoqi, connection)
        stop = threading.Event()

        def speak() -> None:
            """The robot's part: blocks for everybody who has subscribed."""
            while not stop.wait(0.1):
                for name in list(device.subscribed):
                    with contextlib.suppress(RuntimeError):  # its service has ended
                        ear.send(name, 1)

        robot = threading.Thread(target=speak)
        robot.start()
        ear.stream.start()
        yield ear
        ear.stream.close()
        stop.set()
        robot.join(10.0)


@pytest.mark.parametrize("faults", [["refused"] * 3, ["lost"] * 2, ["unanswered"]], ids=lambda faults: faults[0])
def test_unsubscribing_is_repeated_until_the_robot_has_done_it(device, ear, wait_until, faults) -> None:
    wait_until(lambda: ear.blocks, "the robot is heard")
    device.next["unsubscribe"] = list(faults)
    ear.stream.wanted = False
    wait_until(lambda: not device.next["unsubscribe"], "the faults have happened")
    wait_until(lambda: not device.subscribed, "the robot streams no more")
    wait_until(lambda: not ear.stream._left, "and is asked no more")
    ear.stream.wanted = True
    ear.blocks.clear()
    wait_until(lambda: ear.blocks, "the robot is heard again")


def test_a_subscription_without_an_answer_does_not_double_the_sound(device, ear, wait_until) -> None:
    wait_until(lambda: ear.blocks, "the robot is heard")
    ear.stream.wanted = False
    wait_until(lambda: not device.subscribed, "nobody listens")
    device.next = {"subscribe": ["unanswered"], "unsubscribe": ["lost"] * 2}
    ear.stream.wanted = True
    wait_until(lambda: device.subscribed, "it is subscribed and does not answer")
    old = device.subscribed[0]
    wait_until(lambda: len(device.subscribed) == 2, "a new name is subscribed")
    new = device.subscribed[1]
    wait_until(lambda: ear.stream.problem is None, "the robot is heard")
    ear.send(old, 2)
    ear.send(new, 3)
    assert 3 in ear.blocks and 2 not in ear.blocks
    wait_until(lambda: device.subscribed == [new], "the old name is unsubscribed")


def test_closing_leaves_no_subscription(device, ear, wait_until) -> None:
    wait_until(lambda: ear.blocks, "the robot is heard")
    assert device.subscribed[0].startswith(f"PilotsEars{os.getpid()}_")
    ear.stream.close()
    wait_until(lambda: not device.subscribed, "the robot streams no more")


def test_nothing_stays_registered_that_is_not_subscribed(device, ear, wait_until) -> None:
    wait_until(lambda: ear.blocks, "the robot is heard")
    for _ in range(3):
        ear.stream.wanted = False
        wait_until(lambda: not ear.registered(), "the robot is told that the service has ended")
        ear.stream.wanted = True
        wait_until(lambda: ear.stream.problem is None, "the robot is heard again")
    assert ear.registered() == device.subscribed


def test_a_robot_that_refuses_is_asked_less_often_and_keeps_no_service(device, ear, wait_until) -> None:
    wait_until(lambda: ear.blocks, "the robot is heard")
    ear.stream.wanted = False
    wait_until(lambda: not device.subscribed, "nobody listens")
    device.asked.clear()
    device.next["subscribe"] = ["refused"] * 3
    ear.stream.wanted = True
    wait_until(lambda: ear.stream.problem is None, "the robot is heard after three refusals")
    pauses = [later - earlier for earlier, later in itertools.pairwise(device.asked)]
    assert len(pauses) == 3 and pauses[0] >= FIRST_PAUSE and pauses[2] >= 4 * FIRST_PAUSE
    assert ear.registered() == device.subscribed
