"""ALAudioPlayer: plays WAV, Ogg and MP3 files from the robot's disk.

A file is loaded under a number and can then be played, paused and positioned. Calls that play end with the sound.
"""

from __future__ import annotations

import concurrent.futures
import itertools
import threading
import time
from typing import Any

import numpy as np

from pepper_sim.body.description import SOUND_RATE
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.audio.sound_sets import SoundFile, SoundSets
from pepper_sim.naoqi.service import Module, ServiceError, remote, within
from pepper_sim.naoqi.tasks import Alarm, chained
from pepper_sim.sound.compressed import FORMATS, read_compressed
from pepper_sim.sound.room import Room, Sound, read_wave, sine

MAX_FILES = 200
MAX_SOUNDS = 200
"""Sounds that may play at the same time."""


class ALAudioPlayer(Module):
    """Plays sound files."""

    name = "ALAudioPlayer"

    def __init__(self, room: Room, disk: RobotDisk, alarm: Alarm) -> None:
        self._loudspeaker = room.loudspeaker
        self._disk = disk
        self._alarm = alarm
        self._lock = threading.RLock()
        self._files: dict[int, SoundFile] = {}
        self._playing: set[SoundFile] = set()
        """Loaded ones, and those that a call plays without loading them."""
        self._numbers = itertools.count(1)
        self._master = 1.0
        self._sets = SoundSets(disk, self.begin)

    def parts(self) -> tuple[Any, ...]:
        return self, self._sets

    # --- playing -----------------------------------------------------------------------------------------------------

    @remote("i(s)")
    def loadFile(self, fileName: str) -> int:
        """Loads a file and returns its number."""
        return self._load(self._open(fileName))

    @remote("v(s)", "v(sff)")
    def playFile(self, fileName: str, volume: float = 1.0, pan: float = 0.0) -> concurrent.futures.Future:
        """Plays a file; ends with it."""
        return self.begin(self._open(fileName), volume, pan, loop=False)

    @remote("v(s)", "v(sff)")
    def playFileInLoop(self, fileName: str, volume: float = 1.0, pan: float = 0.0) -> None:
        """Plays a file again and again until stopAll; the call ends at once, because no call waits for ever. The file
        is loaded meanwhile."""
        file = self._open(fileName)
        file.only_playing = True
        number = self._load(file)
        try:
            self.begin(file, volume, pan, loop=True)
        except ServiceError:
            self.stop(number)
            raise

    @remote("v(i)", "v(iff)")
    def play(self, taskId: int, volume: float = 1.0, pan: float = 0.0) -> concurrent.futures.Future:
        """Plays a loaded file from its position; ends with it."""
        return self.begin(self._file(taskId), volume, pan, loop=False)

    @remote("v(i)", "v(iff)")
    def playInLoop(self, taskId: int, volume: float = 1.0, pan: float = 0.0) -> None:
        """Plays a loaded file again and again until it is stopped; the call ends at once."""
        self.begin(self._file(taskId), volume, pan, loop=True)

    @remote("v(i)")
    def pause(self, id: int) -> None:
        """Pauses a file at its position."""
        self._halt(self._file(id))

    @remote("v(i)")
    def stop(self, identity: int) -> None:
        """Stops a file and goes back to its beginning; a number of no file is no error, as of every module's stop."""
        with self._lock:
            file = self._files.get(identity)
        if file is not None:
            self._stop(file)

    @remote("v()")
    def stopAll(self) -> None:
        """Stops every sound of this service."""
        with self._lock:
            files = {*self._files.values(), *self._playing}
        for file in files:
            self._stop(file)

    @remote("v(if)")
    def goTo(self, playId: int, position: float) -> None:
        """Sets the position [s]; a file that is playing starts there when it is played again."""
        file = self._file(playId)
        file.position = within(position, 0.0, file.length, "position")

    @remote("f(i)")
    def getCurrentPosition(self, playId: int) -> float:
        """Returns the position in a file [s]."""
        return _position(self._file(playId))

    @remote("f(i)")
    def getFileLength(self, playId: int) -> float:
        """Returns the length of a file [s]."""
        return self._file(playId).length

    @remote("v(i)")
    def unloadFile(self, id: int) -> None:
        """Forgets a file."""
        self._halt(self._file(id))
        with self._lock:
            self._files.pop(id, None)

    @remote("v()")
    def unloadAllFiles(self) -> None:
        """Forgets all files."""
        self.stopAll()
        with self._lock:
            self._files.clear()

    @remote("[s]()")
    def getLoadedFilesNames(self) -> list[str]:
        """Lists the loaded files."""
        with self._lock:
            return [file.name for file in self._files.values()]

    @remote("v(sf)", "v(sfff)")
    def playFileFromPosition(
        self, fileName: str, position: float, volume: float = 1.0, pan: float = 0.0
    ) -> concurrent.futures.Future:
        """Plays a file from a position on [s]; ends with it."""
        file = self._open(fileName)
        file.position = within(position, 0.0, file.length, "position")
        return self.begin(file, volume, pan, loop=False)

    @remote("[s]()")
    def getLoadedFilesIds(self) -> list[str]:
        """Lists the numbers of the loaded files, as text, as robots answer."""
        with self._lock:
            return [str(number) for number in self._files]

    @remote("v(iiif)")
    def playSine(self, frequence: int, gain: int, pan: int, duration: float) -> concurrent.futures.Future:
        """Plays a tone [Hz, 0 to 100, -1 to 1, s]; ends with it."""
        within(frequence, 1, 20000, "frequence")
        within(gain, 0, 100, "gain")
        within(pan, -1, 1, "pan")
        within(duration, 0.0, 600.0, "duration")
        return self.begin(
            SoundFile(sine(frequence, duration, SOUND_RATE, gain / 100.0), SOUND_RATE), 1.0, 0.0, loop=False
        )

    @remote("v(sff)")
    def playWebStream(self, streamName: str, volume: float, pan: float) -> None:
        """Plays a stream from the network. Pepper's NAOqi 2.5 does not fetch HTTP either."""
        raise ServiceError("streams cannot be played on this robot")

    # --- volumes -----------------------------------------------------------------------------------------------------

    @remote("v(f)")
    def setMasterVolume(self, volume: float) -> None:
        """Sets the volume of all files, 0 to 1."""
        self._master = within(volume, 0.0, 1.0, "volume")

    @remote("v(f)")
    def setPanorama(self, pan: float) -> None:
        """Sets the balance of all files, -1 left to 1 right. The simulated loudspeaker is one; nothing is louder."""
        within(pan, -1.0, 1.0, "pan")

    @remote("f()")
    def getMasterVolume(self) -> float:
        """Returns the volume of all files."""
        return self._master

    @remote("v(if)")
    def setVolume(self, id: int, volume: float) -> None:
        """Sets the volume of a file, 0 to 1."""
        self._file(id).volume = within(volume, 0.0, 1.0, "volume")

    @remote("f(i)")
    def getVolume(self, id: int) -> float:
        """Returns the volume of a file."""
        return self._file(id).volume

    # --- inside ------------------------------------------------------------------------------------------------------

    def _open(self, name: str) -> SoundFile:
        path = self._disk.path(name)
        if not path.is_file():
            raise ServiceError(f"file '{name[:120]}' was not found")
        if path.suffix.lower() in FORMATS:
            samples, rate = read_compressed(path)
            return SoundFile(samples.mean(axis=1, dtype=np.float32) / 32768.0, rate, name)
        return SoundFile(*read_wave(path), name)

    def _file(self, number: int) -> SoundFile:
        with self._lock:
            if number not in self._files:
                raise ServiceError(f"no file is loaded under the number {number}")
            return self._files[number]

    def _load(self, file: SoundFile) -> int:
        """Give a file a number."""
        with self._lock:
            if len(self._files) >= MAX_FILES:
                raise ServiceError(f"{MAX_FILES} files are already loaded")
            number = next(self._numbers)
            self._files[number] = file
        return number

    def begin(self, file: SoundFile, volume: float, pan: float, *, loop: bool) -> concurrent.futures.Future:
        """Play a file from its position; the future is done at its end, or when it is stopped.

        Raises: ServiceError: Volume or balance is out of range, or too much is playing.
        """
        within(volume, 0.0, 1.0, "volume")
        within(pan, -1.0, 1.0, "pan")
        with self._lock:
            self._halt(file)
            if len(self._playing) >= MAX_SOUNDS:
                raise ServiceError(f"{MAX_SOUNDS} sounds are already playing")
            shift = int(file.position * file.rate)
            samples = np.roll(file.samples, -shift) if loop else file.samples[shift:]
            loudness = volume * file.volume * self._master
            file.loop = loop
            sound = self._loudspeaker.play(samples, file.rate, gain=loudness, loop=loop)
            end = self._alarm.after(0.0 if loop else len(samples) / file.rate)
            file.sound, file.end = sound, end
            self._playing.add(file)
        if loop:
            return chained(end, lambda _: None)
        end.add_done_callback(lambda _: self._over(file, sound))
        answer = chained(end, lambda _: None)
        answer.add_done_callback(lambda done: self._stop(file, sound) if done.cancelled() else None)
        return answer

    def _over(self, file: SoundFile, sound: Sound) -> None:
        """A sound has come to its end, or was halted."""
        with self._lock:
            if file.sound is sound:
                self._playing.discard(file)
                self._unload_if_only_playing(file)

    def _stop(self, file: SoundFile, sound: Sound | None = None) -> None:
        """Halt a file and go back to its beginning; only if it plays `sound`, if that is given."""
        with self._lock:
            if sound is not None and file.sound is not sound:
                return
            self._halt(file)
            file.position = 0.0
            self._unload_if_only_playing(file)

    def _unload_if_only_playing(self, file: SoundFile) -> None:
        if file.only_playing:
            self._files = {number: known for number, known in self._files.items() if known is not file}

    def _halt(self, file: SoundFile) -> None:
        with self._lock:
            if file.sound is None:
                return
            file.position = _position(file)
            self._loudspeaker.track.cut(file.sound)
            file.sound = None
            self._playing.discard(file)
            end, file.end = file.end, None
        if end is not None:
            end.cancel()


def _position(file: SoundFile) -> float:
    if file.sound is None:
        return file.position
    played = file.position + time.monotonic() - file.sound.start
    if file.loop and file.length:
        return played % file.length
    return played if played < file.length else 0.0
