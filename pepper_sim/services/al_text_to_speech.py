r"""ALTextToSpeech: says texts, one after the other, in real time. The last one is recorded on the robot's disk.

Texts may contain the engine's tags: \rspd=80\ speed [%], \vct=120\ pitch [%], \vol=50\ loudness [%], \pau=500\ pause
[ms], \rst\ back to the defaults; others are dropped. The last value of each tag applies to the whole text.
"""

from __future__ import annotations

import concurrent.futures
import itertools
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, within
from pepper_sim.naoqi.speech_languages import LANGUAGES
from pepper_sim.naoqi.tasks import Workers, chained
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.sound.room import write_wave
from pepper_sim.sound.speech import MAX_SPEED, MIN_SPEED, SPEAKER, SpeechStyle, Voice, synthesise
from telepresence.naoqi.signals import Signal

MAX_TEXT, MAX_QUEUE = 20_000, 50
_TAG = re.compile(r"\\+\s*([A-Za-z]+)\s*(?:=\s*([^\\]*))?\\+")
_ANIMATION = re.compile(r"\^\w+\([^)]*\)")
_PARAMETERS = {
    "pitchShift": (0.0, 4.0, 1.0),
    "doubleVoice": (0.0, 4.0, 0.0),
    "doubleVoiceLevel": (0.0, 4.0, 0.0),
    "doubleVoiceTimeShift": (0.0, 0.5, 0.0),
    "speed": (50.0, MAX_SPEED, 100.0),
    "defaultVoiceSpeed": (50.0, MAX_SPEED, 100.0),
    "pitch": (50.0, 200.0, 100.0),
}
"""Name -> (least, greatest, default)."""
_INITIAL_VALUES: dict[str, Any] = {
    "TextStarted": False,
    "TextDone": True,
    "TextInterrupted": False,
    "CurrentSentence": "",
    "CurrentWord": "",
    "CurrentBookMark": 0,
    "PositionOfCurrentWord": 0,
    "Status": [0, "done"],
}
"""Event -> its value before the first text."""


class ALTextToSpeech(Module):
    """Makes the robot speak."""

    name = "ALTextToSpeech"

    def __init__(self, memory: ALMemory, voice: Voice, disk: RobotDisk, workers: Workers) -> None:
        self._memory = memory
        self._voice = voice
        self._disk = disk
        self._workers = workers
        self._language = "English"
        self._volume = 0.55
        self._parameters = {name: default for name, (_, _, default) in _PARAMETERS.items()}
        self._numbers = itertools.count(1)
        self._number = 0
        self.synchroTTS = Signal("(m)")
        self.languageTTS = Signal("(s)")
        memory.declare((f"ALTextToSpeech/{event}" for event in _INITIAL_VALUES), self.name)
        for event, value in _INITIAL_VALUES.items():
            memory.store(f"ALTextToSpeech/{event}", value)
        voice.on_begin, voice.on_word, voice.on_end = self._begun, self._word, self._ended

    def close(self) -> None:
        self._voice.close()
        for callback in ("on_begin", "on_word", "on_end"):
            setattr(self._voice, callback, lambda *_: None)

    # --- saying ------------------------------------------------------------------------------------------------------

    @remote("v(s)", "v(ss)")
    def say(self, stringToSay: str, language: str = "") -> concurrent.futures.Future | None:
        """Says a text, optionally in another language; ends when it has been said or is interrupted."""
        voice = LANGUAGES[one_of(language or self._language, LANGUAGES, "language")][1]
        return self.speak(stringToSay, voice)

    @remote("i(ss)")
    def sayToFile(self, pStringToSay: str, pFileName: str) -> concurrent.futures.Future:
        """Says a text into a WAV file on the robot's disk."""
        text, style = self._prepare(pStringToSay, LANGUAGES[self._language][1])
        target = self._disk.path(pFileName)
        return self._workers.run(self._write, text, style, target)

    @remote("v()")
    def stopAll(self) -> None:
        """Stops the text being said and all that wait."""
        self._voice.stop()

    def speak(self, text: str, voice: str | None = None) -> concurrent.futures.Future | None:
        """Queue a text, for other services; the future is done when it has been said. None for an empty text."""
        text, style = self._prepare(text, voice or LANGUAGES[self._language][1])
        if not text.strip():
            return None
        if self._voice.waiting() >= MAX_QUEUE:
            raise ServiceError(f"{MAX_QUEUE} texts are already waiting")
        return chained(self._voice.say(text, style), lambda _: None)

    # --- settings ----------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def setLanguage(self, pLanguage: str) -> None:
        """Sets the language."""
        self._language = one_of(pLanguage, LANGUAGES, "pLanguage")
        self.languageTTS(pLanguage)

    @remote("s()")
    def getLanguage(self) -> str:
        """Returns the language."""
        return self._language

    @remote("[s]()")
    def getAvailableLanguages(self) -> list[str]:
        """Lists the installed languages."""
        return list(LANGUAGES)

    @remote("[s]()")
    def getSupportedLanguages(self) -> list[str]:
        """Lists the languages that could be installed."""
        return list(LANGUAGES)

    @remote("s()", "s(s)")
    def locale(self, language: str = "") -> str:
        """Returns the locale of a language, by default the current one."""
        return LANGUAGES[one_of(language or self._language, LANGUAGES, "language")][0]

    @remote("v(f)")
    def setVolume(self, volume: float) -> None:
        """Sets the voice's loudness, 0 to 1."""
        self._volume = within(volume, 0.0, 1.0, "volume")

    @remote("f()")
    def getVolume(self) -> float:
        """Returns the voice's loudness."""
        return self._volume

    @remote("v(sf)")
    def setParameter(self, pEffectName: str, pEffectValue: float) -> None:
        """Sets pitchShift, doubleVoice, doubleVoiceLevel, doubleVoiceTimeShift, speed or pitch."""
        least, greatest, _ = _PARAMETERS[one_of(pEffectName, _PARAMETERS, "pEffectName")]
        self._parameters[pEffectName] = within(pEffectValue, least, greatest, "pEffectValue")

    @remote("f(s)")
    def getParameter(self, pParameterName: str) -> float:
        """Returns a parameter."""
        return self._parameters[one_of(pParameterName, self._parameters, "pParameterName")]

    @remote("v()")
    def resetSpeed(self) -> None:
        """Resets the speed to its default."""
        self._parameters["speed"] = 100.0

    @remote("v(s)")
    def setVoice(self, pVoiceID: str) -> None:
        """Sets the voice; there is only one."""
        one_of(pVoiceID, self.getAvailableVoices(), "pVoiceID")

    @remote("s()")
    def getVoice(self) -> str:
        """Returns the voice."""
        return SPEAKER

    @remote("[s]()")
    def getAvailableVoices(self) -> list[str]:
        """Lists the voices."""
        return [SPEAKER] if shutil.which(SPEAKER) else []

    @remote("v(b)")
    def enableNotifications(self, enable: bool = True) -> None:
        """Switches the events of this service on or off. Ignored: they are always raised."""

    @remote("b(ssss)", "b(ssssi)")
    def addToDictionary(self, type: str, word: str, priority: str, phonetic: str, accent: int = 0) -> bool:
        """Adds the pronunciation of a word. There is no dictionary: false."""
        return False

    @remote("b(s)")
    def deleteFromDictionary(self, word: str) -> bool:
        """Removes the pronunciation of a word; none is known: false."""
        return False

    # --- inside ------------------------------------------------------------------------------------------------------

    def _prepare(self, text: str, voice: str) -> tuple[str, SpeechStyle]:
        """Return the text without tags, and the style that tags and settings specify."""
        if len(text) > MAX_TEXT:
            raise ServiceError(f"the text has {len(text)} characters; at most {MAX_TEXT} can be said at once")
        shift = self._parameters["pitchShift"]
        pitch = self._parameters["pitch"] * (shift if shift >= 0.5 else 1.0)
        default = SpeechStyle(voice, self._parameters["speed"], pitch, self._volume)
        style = default
        for name, value in _TAG.findall(text):
            style = _apply(style, default, name.lower(), value)
        pauses = _TAG.sub(lambda match: ", " if match.group(1).lower() == "pau" else " ", _ANIMATION.sub(" ", text))
        return re.sub(r"\s+", " ", pauses).strip(" "), style

    def _write(self, text: str, style: SpeechStyle, target: Path) -> int:
        write_wave(target, *synthesise(text, style))
        return 0

    def _begun(self, text: str) -> None:
        self._number = next(self._numbers)
        self._announce("TextDone", False)
        self._announce("CurrentSentence", text)
        self._announce("TextStarted", True)
        self._announce("Status", [self._number, "started"])

    def _word(self, word: str, position: int) -> None:
        self._announce("CurrentWord", word)
        self._announce("PositionOfCurrentWord", position)

    def _ended(self, interrupted: bool) -> None:
        self._announce("TextStarted", False)
        self._announce("CurrentWord", "")
        self._announce("CurrentSentence", "")
        if interrupted:
            self._announce("TextInterrupted", True)
        self._announce("TextDone", True)
        self._announce("Status", [self._number, "stopped" if interrupted else "done"])

    def _announce(self, event: str, value: object) -> None:
        self._memory.announce(f"ALTextToSpeech/{event}", value)


def _apply(style: SpeechStyle, default: SpeechStyle, tag: str, value: str) -> SpeechStyle:
    """Return the style after a tag."""
    if tag == "rst":
        return default
    if not value.strip().isdigit():
        return style
    number = float(value)
    if tag == "rspd":
        return replace(style, speed=within(number, MIN_SPEED, MAX_SPEED, "\\rspd\\"))
    if tag == "vct":
        return replace(style, pitch=within(number, 50.0, 200.0, "\\vct\\"))
    if tag == "vol":
        return replace(style, volume=within(number, 0.0, 100.0, "\\vol\\") / 100.0)
    return style
