"""The robot's microphones, through NAOqi alone: the robot calls a service of ours with every block of sound.

Wire: a service registered by this side with a method `processRemote(channels, samples per channel, [s, µs], buffer)`;
`ALAudioDevice.setClientPreferences(name, rate, channels, deinterleaved)`, `subscribe(name)`, `unsubscribe(name)`.
Buffers are int16 little-endian: 48000 Hz with four microphones, or 16000 Hz with one. A block is 85 to 170 ms long,
which is the larger part of the delay. The robot calls over the connection that we opened, or opens one to this machine
(`naoqi_driver.call_back`), where a firewall may be in its way; that is noticed here. Source: NAOqi 2.8 documentation,
ALAudioDevice.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from naoqi_driver.connection import CallRefused, Connection, RobotError, RobotUnreachable

from telepresence import naoqi
from telepresence.security.change_log import ChangeLog

log = logging.getLogger(__name__)

MICROPHONES = {"stereo": (48000, 0, 0), "front": (16000, 3, 0)}
"""Choice of microphones -> rate [Hz], channels, deinterleaved, as `setClientPreferences` takes them."""
FRONT_LEFT, FRONT_RIGHT = 2, 3
"""Order of Pepper's four microphones: rear left, rear right, front left, front right."""
MOST_SAMPLES = 48_000
"""Samples of each microphone in one block at most: a second. NAOqi sends a sixth of that at most."""
BURST, FASTEST = 2.0, 1.5
"""Seconds of sound that may come at once, and seconds of sound per second: what comes faster is left out."""
SILENT_AFTER = 3.0
"""Seconds without a block after which the subscription counts as dead."""
UNSUBSCRIBE_PERIOD = 2.0
"""Seconds until a name that the robot has not confirmed to have unsubscribed is unsubscribed again."""
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 10.0
"""Seconds until a robot that has refused to be listened to, or sends nothing, is asked again; doubled each time."""
_DEVICE = "ALAudioDevice"


class _Ear(NamedTuple):
    """A service by which the robot is listened to, and the link on which the robot's directory has it as `number`."""

    name: str
    link: int
    number: int


class MicrophoneStream:
    """Listens while `wanted` and connected, from `start` to `close`.

    Args:
        on_block: Gets every block: (n, channels) int16, samples per second, arrival [s, monotonic]; on another thread.
        microphones: "stereo": the two in front at 48 kHz, 3 Mbit/s on the robot's Wi-Fi. "front": one at 16 kHz,
            a twelfth of that.
    """

    def __init__(
        self,
        connection: Connection,
        on_block: Callable[[np.ndarray, int, float], None],
        microphones: str = "stereo",
    ) -> None:
        if microphones not in MICROPHONES:
            raise ValueError(f"microphones are {' or '.join(MICROPHONES)}, not {microphones!r}")
        self.rate = MICROPHONES[microphones][0]
        self.channels = 2 if microphones == "stereo" else 1
        self.wanted = True
        """False while nobody listens."""
        self.problem: str | None = "not connected yet"
        """Why no sound arrives; None while blocks come."""
        self.blocks = 0
        self._preferences = MICROPHONES[microphones]
        self._connection = connection
        self._on_block = on_block
        self._link = -1  # number of the link on which the subscription was made
        self._last_block = self._asked = 0.0
        self._credit = BURST
        self._log = ChangeLog()
        self._told: str | None = None
        self._ear: _Ear | None = None  # by which the robot is listened to; None while it is not
        self._left: list[_Ear] = []  # to which the robot may still send
        self._heard_left = 0.0  # when one of them was left, or a block of theirs came last [s, monotonic]
        self._unsubscribe_at = self._ask_at = 0.0
        self._pause = FIRST_PAUSE
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="microphone-stream", daemon=True)

    def start(self) -> MicrophoneStream:
        self._thread.start()
        return self

    def close(self) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join(timeout=3.0)

    def _run(self) -> None:
        while not self._stop.wait(0.2):
            try:
                self._keep()
            except RobotError as error:
                self._report(str(error))
                self._link = -1
                self._put_off()
            except Exception:  # top of the thread: it goes on and tries again
                log.exception("the robot's microphones cannot be kept")
                self._stop.wait(1.0)
        self._leave()
        self._unsubscribe()

    def _keep(self) -> None:
        """Subscribe, or unsubscribe, as things stand."""
        if not self._connection.connected:
            self._link = -1
            self._forget_refusals()
            self.problem = self._connection.problem
            return
        subscribed = self._link == self._connection.connections
        if time.monotonic() >= self._unsubscribe_at:
            self._unsubscribe()
        now = time.monotonic()
        if not self.wanted:
            if subscribed:
                self._leave()
            self._forget_refusals()
            self.problem = "nobody listens"
        elif not subscribed:
            if now >= self._ask_at:
                self._subscribe(now)
        elif now - max(self._last_block, self._asked) > SILENT_AFTER:
            self._report(f"the robot's microphones send nothing: {self._way_here()}")
            self._leave()
            if self._last_block < self._asked:  # else it has sent until now, and may at once again
                self._put_off()

    def _put_off(self) -> None:
        """Ask the robot later, and each time later."""
        self._ask_at = time.monotonic() + self._pause
        self._pause = min(2.0 * self._pause, LONGEST_PAUSE)

    def _forget_refusals(self) -> None:
        """Things are not what they were when the robot refused: it may be asked at once."""
        self._ask_at, self._pause = 0.0, FIRST_PAUSE

    def _subscribe(self, now: float) -> None:
        link = self._connection.connections
        call = self._connection.call
        name = f"PilotsEars{os.getpid()}_{link}_{int(now * 1000) % 100000}"
        number = self._connection.register_service(name, _listener(partial(self._received, name)))
        self._ear = ear = _Ear(name, link, number)
        try:
            call(_DEVICE, "setClientPreferences", name, *self._preferences)
            call(_DEVICE, "subscribe", name, timeout=3.0)
        except CallRefused as error:
            self._ear = None
            self._unregister(ear)
            if "find service" not in str(error).lower():
                raise
            raise CallRefused(f"{error}: {self._way_here()}") from None
        except RobotError as error:
            self._leave()  # without an answer it may have been done, or be done later
            if "subscribe" not in str(error) or not self._connection.connected:
                raise
            # Where its packets are dropped on their way, it tries for longer than we wait.
            raise RobotUnreachable(f"{error}: {self._way_here()}") from None
        self._link, self._asked = link, time.monotonic()

    def _way_here(self) -> str:
        """What may be wrong when the robot does not reach a service of ours."""
        where = self._connection.listens_at
        if where:
            return f"the robot must be able to connect to {where}; let it through the firewall (qi_listen_url)"
        return "the robot may need to connect to this machine, where nothing listens for it (qi_listen_url)"

    def _leave(self) -> None:
        """Take no more blocks by the present service, and have the robot send none soon."""
        if self._ear is not None:
            self._left.append(self._ear)
            self._heard_left, self._unsubscribe_at = time.monotonic(), 0.0
        self._ear, self._link = None, -1

    def _unsubscribe(self) -> None:
        """Ask the robot to send nothing more to the services that were left; what it does not confirm is asked again.

        Else it would stream on, 3 Mbit/s, and beside the next service all sound would come twice.
        """
        if not self._connection.connected:
            return
        for ear in list(self._left):
            if ear.link == self._connection.connections:  # else the service, and what the robot has of it, have ended
                try:
                    self._connection.call(_DEVICE, "unsubscribe", ear.name)
                except CallRefused as error:
                    log.debug("not unsubscribed: %s", error)
                    if time.monotonic() - self._heard_left < SILENT_AFTER:
                        continue  # else it is not subscribed: an earlier request has been carried out late
                except RobotError as error:
                    log.debug("not unsubscribed: %s", error)
                    break
                self._unregister(ear)
            self._left.remove(ear)
        self._unsubscribe_at = time.monotonic() + UNSUBSCRIBE_PERIOD

    def _unregister(self, ear: _Ear) -> None:
        """Take a service out of the robot's directory, which keeps it until the link ends, and takes only so many."""
        try:
            self._connection.unregister_service(ear.number)
        except RobotError as error:
            log.debug("'%s' stays in the robot's directory until the link ends: %s", ear.name, error)

    def _received(self, name: str, channels: int, count: int, buffer: Any) -> None:
        if self._ear is None or name != self._ear.name:
            self._heard_left = time.monotonic()
            return
        size = len(buffer) if isinstance(buffer, bytes | bytearray) else -1
        if not (0 < channels <= 8 and 0 < count <= MOST_SAMPLES and size >= 2 * channels * count):
            self._report(f"a block of {size} bytes claims {channels} x {count} samples; it is left out")
            return
        samples = np.frombuffer(buffer, "<i2", channels * count)
        now = time.monotonic()
        self._credit = min(BURST, self._credit + FASTEST * (now - self._last_block)) - count / self.rate
        if self._credit < 0.0:
            self._credit += count / self.rate
            return  # nobody speaks faster than time goes by
        block: np.ndarray = samples.reshape(count, channels)
        if channels == 4:
            block = block[:, (FRONT_LEFT, FRONT_RIGHT)]
        if block.shape[1] != self.channels:
            block = np.repeat(block[:, :1], self.channels, axis=1)
        self._last_block = now
        self._pause = FIRST_PAUSE
        self.blocks += 1
        if self.problem is not None:
            self.problem = self._told = None
            self._log.repeat()
        self._on_block(block, self.rate, self._last_block)

    def _report(self, problem: str) -> None:
        self.problem = problem
        if problem != self._told and self._connection.connected:
            if self._log.note(time.monotonic(), f"the robot is not heard: {problem}", log.warning):
                self._told = problem


def _listener(on_sound: Callable[[int, int, Any], None]) -> object:
    """The service that the robot calls. Every attribute is shown to the robot, so it has none."""

    class Listener:
        @naoqi.bind(naoqi.Void, (naoqi.Int32, naoqi.Int32, naoqi.Dynamic, naoqi.Buffer))
        def processRemote(self, nbOfChannels: int, nbOfSamplesByChannel: int, timeStamp: Any, buffer: Any) -> None:
            try:
                on_sound(nbOfChannels, nbOfSamplesByChannel, buffer)
            except Exception:  # it would be sent back to the robot, which has no use for it
                log.exception("a block of the robot's microphones is lost")

    return Listener()
