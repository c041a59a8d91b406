"""The sound sets of ALAudioPlayer: folders of WAV files on the robot's disk, which are played by name."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import ServiceError, one_of, remote, within
from pepper_sim.sound.robot_sounds import SOUND_SETS, STANDARD_SET
from pepper_sim.sound.room import Sound, read_wave


@dataclass(eq=False)
class SoundFile:
    """A file that was read; `position` [s] is where it plays next. One that is `only_playing` is loaded until it
    has been stopped or has come to its end; a pause is neither."""

    samples: np.ndarray
    rate: int
    name: str = ""
    volume: float = 1.0
    position: float = 0.0
    sound: Sound | None = None
    end: concurrent.futures.Future | None = None
    loop: bool = False
    only_playing: bool = False

    @property
    def length(self) -> float:
        return len(self.samples) / self.rate


class SoundSets:
    """Remote methods of ALAudioPlayer about sound sets. The standard one is loaded at the start.

    Args:
        begin: Plays a file with volume, balance and in a loop or not; see `ALAudioPlayer.begin`.
    """

    def __init__(self, disk: RobotDisk, begin: Callable[..., concurrent.futures.Future]) -> None:
        self._folder = disk.path(SOUND_SETS)
        self._begin = begin
        self._loaded = [STANDARD_SET]

    @remote("[s]()")
    def getInstalledSoundSetsList(self) -> list[str]:
        """Lists the sound sets."""
        return sorted(folder.name for folder in self._folder.iterdir() if folder.is_dir())

    @remote("[s]()")
    def getLoadedSoundSetsList(self) -> list[str]:
        """Lists the loaded sound sets."""
        return list(self._loaded)

    @remote("[s](s)")
    def getSoundSetFileNames(self, setName: str) -> list[str]:
        """Lists the sounds of a set."""
        return sorted(path.stem for path in self._set(setName).glob("*.wav"))

    @remote("b(s)")
    def isSoundSetInstalled(self, setName: str) -> bool:
        """Whether there is a sound set."""
        return setName in self.getInstalledSoundSetsList()

    @remote("b(s)")
    def isSoundSetLoaded(self, setName: str) -> bool:
        """Whether a sound set is loaded."""
        return setName in self._loaded

    @remote("b(ss)")
    def isSoundSetFileInstalled(self, setName: str, fileName: str) -> bool:
        """Whether a sound set holds a sound."""
        return self.isSoundSetInstalled(setName) and fileName in self.getSoundSetFileNames(setName)

    @remote("v(s)")
    def loadSoundSet(self, setName: str) -> None:
        """Lets the sounds of a set be played by their names alone."""
        self._set(setName)
        if setName not in self._loaded:
            self._loaded.append(setName)

    @remote("v(s)")
    def unloadSoundSet(self, setName: str) -> None:
        """Lets the sounds of a set no more be played by their names alone."""
        self._loaded.remove(one_of(setName, self._loaded, "setName"))

    @remote("v(s)")
    def playSoundSetFile(self, fileName: str) -> concurrent.futures.Future | None:
        """Plays a sound of the first loaded set that holds it; ends with it."""
        for name in self._loaded:
            if fileName in self.getSoundSetFileNames(name):
                return self._play(name, fileName)
        raise ServiceError(f"no loaded sound set holds the sound '{fileName[:60]}'")

    @remote("v(ss)", "v(ssfffb)", name="playSoundSetFile")
    def playFileOfSoundSet(
        self,
        soundSetName: str,
        fileName: str,
        position: float = 0.0,
        volume: float = 1.0,
        pan: float = 0.0,
        loop: bool = False,
    ) -> concurrent.futures.Future | None:
        """Plays a sound of a set from a position on [s]; ends with it, in a loop at once."""
        return self._play(soundSetName, fileName, position, volume, pan, loop)

    def _play(
        self, set_name: str, name: str, position: float = 0.0, volume: float = 1.0, pan: float = 0.0, loop: bool = False
    ) -> concurrent.futures.Future | None:
        one_of(name, self.getSoundSetFileNames(set_name), "fileName")
        file = SoundFile(*read_wave(self._set(set_name) / f"{name}.wav"), name)
        file.position = within(position, 0.0, file.length, "position")
        end = self._begin(file, volume, pan, loop=loop)
        return None if loop else end

    def _set(self, name: str) -> Path:
        if not self.isSoundSetInstalled(name):
            raise ServiceError(f"sound set '{name[:60]}' is not installed")
        return self._folder / name
