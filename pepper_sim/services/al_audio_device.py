"""ALAudioDevice: microphones to clients, clients' sound to the loudspeaker, volume.

Loudspeaker path: `sendRemoteBufferToOutput(frames, buffer)`, 16 bits, interleaved stereo, at `outputSampleRate`; the
device queues up to 1.3 s, and a call that finds the queue full ends when there is room. Microphone path: see
`pepper_sim.naoqi.audio.microphones`. Sources: NAOqi 2.8 documentation, ALAudioDevice; length of the queue as measured
on a Pepper by navarlu/Pepper.
"""

from __future__ import annotations

import concurrent.futures
import logging
import threading
import time
from typing import Any

import numpy as np

from pepper_sim.body.description import MICROPHONES, SOUND_RATE, VOICE_RATE
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.audio.microphones import BLOCK, MicrophoneStream, Preferences
from pepper_sim.naoqi.audio.recorder import MicrophoneRecorder
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.service import Module, ServiceError, octets, one_of, remote, shown, within
from pepper_sim.naoqi.tasks import Alarm, chained
from pepper_sim.sound.room import FULL_SCALE, Room, Stream, read_channels, sine
from telepresence.naoqi.signals import Signal

log = logging.getLogger(__name__)

MAX_FRAMES = 16384
OUTPUT_RATES = (16000, 22050, 44100, 48000)
DEFAULT_OUTPUT_RATE = 22050
QUEUE = 1.3
"""How much sound the device queues [s]."""
MAX_WAITING = 64
MAX_STREAMS = 16
_BYTES_PER_FRAME = 4
_SIGNAL_PERIOD = 0.13
_ENERGY_WINDOW = 0.17
_MICROPHONES = {"Left": 0, "Right": 1, "Front": 2, "Rear": 3}
"""NAOqi's name of a channel -> its number. The names fit NAO's head; see `pepper_sim.naoqi.audio.microphones`."""


class ALAudioDevice(Module):
    """Sound in and out."""

    name = "ALAudioDevice"

    def __init__(self, room: Room, clients: ClientServices, alarm: Alarm, disk: RobotDisk) -> None:
        self._room = room
        self._clients = clients
        self._alarm = alarm
        self._disk = disk
        self._recorder = MicrophoneRecorder(room, disk)
        self._lock = threading.Lock()
        self._streams: dict[str, MicrophoneStream] = {}
        self._preferences: dict[str, Preferences] = {}
        self._rate = DEFAULT_OUTPUT_RATE
        self._queue: Stream | None = None
        self._waiting = 0
        self._energy = False
        self._closing = threading.Event()
        self.speakersPlaying = Signal("(b)")
        self._thread = threading.Thread(target=self._report_playing, name="speakers-playing", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._thread.join(timeout=2.0)
        with self._lock:
            streams = list(self._streams.values())
        for stream in streams:
            stream.close()
        self._recorder.close()

    # --- loudspeaker -------------------------------------------------------------------------------------------------

    @remote("b(im)")
    def sendRemoteBufferToOutput(self, nbOfFrames: int, buffer: Any) -> bool | concurrent.futures.Future:
        """Plays frames of two int16 samples, left and right, after what is queued; true when they are queued."""
        within(nbOfFrames, 1, MAX_FRAMES, "nbOfFrames")
        buffer = octets(buffer, "buffer")
        if len(buffer) < nbOfFrames * _BYTES_PER_FRAME:
            raise ServiceError(
                f"buffer holds {len(buffer)} bytes; {nbOfFrames} stereo frames of 16 bits are "
                f"{nbOfFrames * _BYTES_PER_FRAME}"
            )
        frames = np.frombuffer(bytes(buffer[: nbOfFrames * _BYTES_PER_FRAME]), "<i2").reshape(-1, 2)
        samples = frames.mean(axis=1, dtype=np.float32) / (FULL_SCALE + 1.0)
        now = time.monotonic()
        with self._lock:
            if self._waiting >= MAX_WAITING:
                return False
            if self._queue is None or self._queue.end < now or self._queue.rate != self._rate:
                self._queue = self._room.loudspeaker.track.open(self._rate, now)
            self._room.loudspeaker.extend(self._queue, samples)
            excess = self._queue.end - now - QUEUE
            if excess <= 0.0:
                return True
            self._waiting += 1
        later = self._alarm.after(excess)
        later.add_done_callback(self._no_longer_waiting)
        return chained(later, lambda _: True)

    @remote("v()")
    def flushAudioOutputs(self) -> None:
        """Drops the queued sound."""
        with self._lock:
            if self._queue is not None:
                self._room.loudspeaker.track.cut(self._queue)
            self._queue = None

    @remote("v(si)")
    def setParameter(self, pParamName: str, pParamValue: int) -> None:
        """Sets outputSampleRate [Hz]: 16000, 22050, 44100 or 48000."""
        one_of(pParamName, ("outputSampleRate", "inputBufferSize"), "pParamName")
        if pParamName == "outputSampleRate":
            self._rate = one_of(pParamValue, OUTPUT_RATES, "pParamValue")
        else:
            one_of(pParamValue, (8192, 16384), "pParamValue")

    @remote("i(s)")
    def getParameter(self, pParamName: str) -> int:
        """Returns outputSampleRate [Hz] or inputBufferSize; -1 for another name."""
        return {"outputSampleRate": self._rate, "inputBufferSize": 8192}.get(pParamName, -1)

    @remote("v(i)")
    def setOutputVolume(self, volume: int) -> None:
        """Sets the volume, 0 to 100; what lies outside is as loud or as quiet as can be."""
        self._room.loudspeaker.volume = min(max(volume, 0), 100) / 100.0

    @remote("i()")
    def getOutputVolume(self) -> int:
        """Returns the volume, 0 to 100."""
        return round(100 * self._room.loudspeaker.volume)

    @remote("v(b)")
    def muteAudioOut(self, mute: bool) -> None:
        """Mutes the loudspeaker."""
        self._room.loudspeaker.muted = mute

    @remote("b()")
    def isAudioOutMuted(self) -> bool:
        """Whether the loudspeaker is muted."""
        return self._room.loudspeaker.muted

    @remote("v(iiif)")
    def playSine(self, frequence: int, gain: int, pan: int, duration: float) -> concurrent.futures.Future:
        """Plays a tone [Hz, 0 to 100, -1 to 1, s]; ends with it."""
        within(frequence, 1, 20000, "frequence")
        within(gain, 0, 100, "gain")
        within(pan, -1, 1, "pan")
        within(duration, 0.0, 600.0, "duration")
        self._room.loudspeaker.play(sine(frequence, duration, SOUND_RATE, gain / 100.0), SOUND_RATE)
        return self._alarm.after(duration)

    @remote("v()")
    def openAudioInputs(self) -> None:
        """Opens the microphones, which are open at the start."""
        self._room.microphones_closed = False

    @remote("v()")
    def closeAudioInputs(self) -> None:
        """Closes the microphones for other programs of the robot: nothing is picked up."""
        self._room.microphones_closed = True

    @remote("b()")
    def isInputClosed(self) -> bool:
        """Whether the microphones are closed."""
        return self._room.microphones_closed

    @remote("v()")
    def openAudioOutputs(self) -> None:
        """Opens the loudspeaker, which is open at the start."""
        self._room.loudspeaker.closed = False

    @remote("v()")
    def closeAudioOutputs(self) -> None:
        """Closes the loudspeaker for other programs of the robot: nothing is played."""
        self.flushAudioOutputs()
        self._room.loudspeaker.closed = True

    @remote("b()")
    def isOutputClosed(self) -> bool:
        """Whether the loudspeaker is closed."""
        return self._room.loudspeaker.closed

    @remote("b(ii)")
    def sendLocalBufferToOutput(self, nbOfFrames: int, buffer: int) -> bool:
        """Plays a buffer of the robot's own process."""
        raise ServiceError("can only be called by a module on the robot; use sendRemoteBufferToOutput")

    # --- microphones -------------------------------------------------------------------------------------------------

    @remote("v(siii)")
    def setClientPreferences(self, name: str, sampleRate: int, channelsVector: int, deinterleaved: int) -> None:
        """Sets what a client receives: 48000 Hz and channels 0 (all four), or 16000 Hz and channel 1 to 4."""
        one_of(sampleRate, BLOCK, "sampleRate")
        one_of(channelsVector, (0,) if sampleRate == SOUND_RATE else (1, 2, 3, 4), "channelsVector")
        one_of(deinterleaved, (0, 1), "deinterleaved")
        with self._lock:
            if len(self._preferences) >= 1000:
                self._preferences.clear()
            self._preferences[name] = Preferences(sampleRate, channelsVector, bool(deinterleaved))

    @remote("v(simii)", name="setClientPreferences")
    def setClientPreferencesOfOlderPrograms(
        self, name: str, sampleRate: int, channelsVector: Any, deinterleaved: int, timestamp: int
    ) -> None:
        """The older form: channels as a list, [1, 1, 1, 1] for all four or with a single 1; `timestamp` has no effect.

        As a number the channels mean the same as in the other form. Time stamps are always sent.
        """
        if not isinstance(channelsVector, int):
            channelsVector = _channel_of(channelsVector)
        self.setClientPreferences(name, sampleRate, channelsVector, deinterleaved)

    @remote("v(s)")
    def setFileAsInput(self, fileName: str) -> None:
        """Reads the microphones from a WAV file, 48000 Hz, 16 bits, four channels; "" for the microphones again."""
        if not fileName:
            self._room.replace_microphones(None)
            return
        path = self._disk.path(fileName)
        if not path.is_file():
            raise ServiceError(f"file '{shown(fileName)[1:-1]}' was not found")
        samples, rate = read_channels(path)
        if rate != SOUND_RATE or samples.shape[1] != MICROPHONES:
            raise ServiceError(
                f"'{shown(fileName)[1:-1]}' has {samples.shape[1]} channels at {rate} Hz; "
                f"{MICROPHONES} at {SOUND_RATE} Hz are needed"
            )
        self._room.replace_microphones(samples, rate)

    @remote("v(s)")
    def subscribe(self, module: str) -> concurrent.futures.Future | None:
        """Starts calling processRemote of the service `module` with every block."""
        if not self._clients.exists(module):
            raise ServiceError(f"can't find service '{shown(module)[1:-1]}'; register it before subscribing")
        if self._clients.dials:
            return chained(self._clients.reach(module), lambda _: self._send_to(module))
        self._send_to(module)
        return None

    def _send_to(self, module: str) -> None:
        with self._lock:
            self._streams = {name: stream for name, stream in self._streams.items() if stream.alive}
            if len(self._streams) >= MAX_STREAMS and module not in self._streams:
                raise ServiceError(f"{MAX_STREAMS} clients are already subscribed")
            old = self._streams.pop(module, None)
            preferences = self._preferences.get(module, Preferences())
            self._streams[module] = MicrophoneStream(module, preferences, self._room, self._clients)
        if old is not None:
            old.close()

    @remote("v(s)")
    def unsubscribe(self, module: str) -> None:
        """Ends the calls to a service."""
        with self._lock:
            stream = self._streams.pop(module, None)
        if stream is None:
            raise ServiceError(f"'{shown(module)[1:-1]}' has not subscribed")
        stream.close()

    @remote("v()")
    def enableEnergyComputation(self) -> None:
        """Switches get...MicEnergy on."""
        self._energy = True

    @remote("v()")
    def disableEnergyComputation(self) -> None:
        """Switches get...MicEnergy off."""
        self._energy = False

    @remote("f()")
    def getFrontMicEnergy(self) -> float:
        """Returns the mean level of the third channel, NAO's front, over 170 ms, 0 to 32768."""
        return self._level("Front")

    @remote("f()")
    def getRearMicEnergy(self) -> float:
        """Returns the mean level of the fourth channel, NAO's rear, over 170 ms, 0 to 32768."""
        return self._level("Rear")

    @remote("f()")
    def getLeftMicEnergy(self) -> float:
        """Returns the mean level of the first channel, NAO's left, over 170 ms, 0 to 32768."""
        return self._level("Left")

    @remote("f()")
    def getRightMicEnergy(self) -> float:
        """Returns the mean level of the second channel, NAO's right, over 170 ms, 0 to 32768."""
        return self._level("Right")

    @remote("v(s)")
    def startMicrophonesRecording(self, pFileName: str) -> None:
        """Records all four microphones into a .wav file on the robot's disk, or the front one into an .ogg file."""
        if pFileName.lower().endswith(".ogg"):
            self._recorder.start(pFileName, VOICE_RATE, [False, False, True, False], ogg=True)
        else:
            self._recorder.start(pFileName, SOUND_RATE, [True] * MICROPHONES)

    @remote("v()")
    def stopMicrophonesRecording(self) -> None:
        """Ends the recording; without one nothing happens."""
        self._recorder.stop()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _level(self, microphone: str) -> float:
        if not self._energy:
            raise ServiceError("the energy is not computed; call enableEnergyComputation first")
        count = int(_ENERGY_WINDOW * VOICE_RATE)
        block = self._room.listen(time.monotonic() - _ENERGY_WINDOW, count, VOICE_RATE)
        return float(np.sqrt(np.mean(block[:, _MICROPHONES[microphone]].astype(np.float64) ** 2)))

    def _no_longer_waiting(self, _: Any) -> None:
        with self._lock:
            self._waiting -= 1

    def _report_playing(self) -> None:
        reported = False
        while not self._closing.wait(_SIGNAL_PERIOD):
            playing = self._room.loudspeaker.track.playing()
            if playing or reported:
                self.speakersPlaying(playing)
            reported = playing


def _channel_of(flags: Any) -> int:
    """Return the number for a list of flags, one for each microphone: 0 for all, 1 to 4 for one.

    Raises: ServiceError: It is another list.
    """
    if isinstance(flags, list | tuple) and len(flags) == MICROPHONES and all(flag in (0, 1) for flag in flags):
        if all(flags):
            return 0
        if sum(flags) == 1:
            return flags.index(1) + 1
    raise ServiceError(f"channelsVector must be [1, 1, 1, 1] or hold a single 1, like [0, 0, 1, 0]; got {shown(flags)}")
