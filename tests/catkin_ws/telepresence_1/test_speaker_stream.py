"""What reaches ALAudioDevice, call by call, from a microphone that the test is."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from naoqi_driver.connection import Address, Connection
from telepresence_1.speaker_stream import CUSHION, PIECE, SpeakerStream

import qi  # isort: skip

RATE = 22050
FRAMES = int(PIECE * RATE)


@qi.multiThreaded()
class AudioDevice:
    """Records its calls; answers only while `answering`."""

    def __init__(self) -> None:
        self._rate = RATE
        self._calls = []
        self._answering = threading.Event()
        self._answering.set()

    @qi.bind(qi.Bool, (qi.Int32, qi.Buffer))
    def sendRemoteBufferToOutput(self, count, buffer):
        samples = np.abs(np.frombuffer(bytes(buffer), "<i2"))
        self._calls.append(("send", count, len(buffer), int(samples[0]), int(samples[-1])))
        self._answering.wait(20.0)
        return True

    def flushAudioOutputs(self):
        self._calls.append(("flush",))

    def closeAudioOutputs(self):
        self._calls.append(("close",))

    def openAudioOutputs(self):
        self._calls.append(("open",))

    def getParameter(self, name):
        return self._rate

    def setParameter(self, name, value):
        self._calls.append(("set", name, value))
        self._rate = value


@pytest.fixture
def device(naoqi) -> AudioDevice:
    device = AudioDevice()
    naoqi.register("ALAudioDevice", device)
    return device


@pytest.fixture
def connection(naoqi, device: AudioDevice) -> Iterator[Connection]:
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as connection:
        assert connection.wait_connected(20.0)
        yield connection


@pytest.fixture
def mouth(connection: Connection) -> Iterator[SpeakerStream]:
    mouth = SpeakerStream(connection).start()
    yield mouth
    mouth.close()


def loud(value: int = 8000) -> bytes:
    return np.full(2 * FRAMES, value, "<i2").tobytes()


def quiet() -> bytes:
    return np.full(2 * FRAMES, 3, "<i2").tobytes()


def sent(device: AudioDevice) -> list[tuple]:
    return [call for call in device._calls if call[0] == "send"]


def test_a_word_is_sent_with_what_was_heard_just_before_it(
    connection: Connection, device: AudioDevice, wait_until: Callable
) -> None:
    mouth = SpeakerStream(connection, clock=lambda: 100.0).start()  # whatever the machine does
    for _ in range(2 * CUSHION):
        mouth.put(quiet())
    mouth.put(loud())
    wait_until(lambda: sent(device), "the word and its cushion")
    mouth.put(loud(9000))
    wait_until(lambda: len(sent(device)) == 2, "what follows")
    frames = (CUSHION + 1) * FRAMES
    assert sent(device) == [("send", frames, 4 * frames, 3, 8000), ("send", FRAMES, 4 * FRAMES, 9000, 9000)]
    assert device._calls[0] == ("flush",), "what somebody else left in the robot's queue is dropped first"
    mouth.close()


def test_sound_in_odd_pieces_is_sent_whole(connection: Connection, device: AudioDevice, wait_until: Callable) -> None:
    mouth = SpeakerStream(connection, clock=lambda: 100.0).start()  # whatever the machine does
    mouth.put(loud())
    wait_until(lambda: sent(device), "the first piece")
    data = loud() * 4
    for start in range(0, len(data), 777):
        mouth.put(data[start : start + 777])
    wait_until(lambda: len(sent(device)) == 5, "all pieces")
    mouth.close()


def test_a_robot_that_does_not_answer_gets_fresh_sound_afterwards(
    mouth: SpeakerStream, device: AudioDevice, wait_until: Callable
) -> None:
    mouth.put(loud())
    wait_until(lambda: sent(device), "the first piece")
    device._answering.clear()
    pause = threading.Event()
    value = 100
    while len(sent(device)) < 60 and value < 160:  # more than a second of sound
        value += 1
        mouth.put(loud(value))
        pause.wait(PIECE)
    held = len(sent(device))
    assert held < 40, "sound is pushed into a link that stands still"
    before = device._calls.count(("flush",))
    device._answering.set()

    def goes_on() -> bool:
        mouth.put(loud(9000))
        pause.wait(PIECE)
        return device._calls[-1][-1] == 9000

    wait_until(goes_on, "sound again")
    assert device._calls.count(("flush",)) > before, "the delay would stay"


def test_a_flood_does_not_become_a_delay(mouth: SpeakerStream, device: AudioDevice, wait_until: Callable) -> None:
    mouth.put(loud(1000))
    wait_until(lambda: sent(device), "the first piece")
    for _ in range(200):
        mouth.put(loud())
    pause = threading.Event()

    def settled() -> bool:
        mouth.put(loud(2000))
        pause.wait(PIECE)
        return sent(device)[-1][3] == 2000

    wait_until(settled, "new sound is sent")
    assert len(sent(device)) < 100


def test_the_rate_is_set_between_closing_and_opening(
    connection: Connection, device: AudioDevice, wait_until: Callable
) -> None:
    changed = threading.Event()
    mouth = SpeakerStream(connection, rate=48000).start()
    device._rate = 16000
    mouth.on_rate = changed.set
    mouth.put(np.full(2 * 960, 5000, "<i2").tobytes())
    wait_until(lambda: ("open",) in device._calls, "the outputs are opened")
    assert device._calls[:3] == [("close",), ("set", "outputSampleRate", 48000), ("open",)]
    assert mouth.rate == 48000
    mouth.close()


def test_the_robots_own_rate_is_kept_unless_one_is_asked_for(
    connection: Connection, device: AudioDevice, wait_until: Callable
) -> None:
    device._rate = 16000
    changed = threading.Event()
    mouth = SpeakerStream(connection)
    mouth.on_rate = changed.set
    mouth.start()
    mouth.put(loud())
    wait_until(changed.is_set, "the other rate is noticed")
    assert mouth.rate == 16000 and not sent(device), "sound of the wrong rate was played"
    mouth.close()


def test_an_impossible_rate_is_refused(connection: Connection) -> None:
    with pytest.raises(ValueError, match="not 12345"):
        SpeakerStream(connection, rate=12345)
