r"""ALTextToSpeech: says texts, one after the other, in real time. The last one is recorded on the robot's disk.

Texts may contain the engine's tags: \rspd=80\ speed [%], \vct=120\ pitch [%], \vol=50\ loudness [%], \pau=500\ pause
[ms], \mrk=7\ bookmark, \rst\ back to the defaults; others are dropped. The last value of speed, pitch and loudness
applies to the whole text.
"""

from __future__ import annotations

import concurrent.futures
import itertools
import logging
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, within
from pepper_sim.naoqi.speech_languages import LANGUAGES, PREFERRED, language_of
from pepper_sim.naoqi.speech_tags import bookmarks, read, spoken, styled
from pepper_sim.naoqi.tasks import Workers, chained
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.sound.room import FULL_SCALE, write_wave
from pepper_sim.sound.speech import MAX_SPEED, SpeechStyle, Utterance, Voice, synthesise
from telepresence.naoqi.signals import Signal

log = logging.getLogger(__name__)

MAX_TEXT, MAX_QUEUE = 20_000, 50
MAX_DICTIONARY = 10_000
PREFERENCES = "/home/nao/naoqi/preferences/ALTextToSpeech_Voice_{}.xml"
"""Where the robot's disk holds the voice preferences that programs load."""
OFFICIAL_VOICE = "NaoOfficialVoice"
"""The preferences of this name and a language are NAOqi's own."""
_PARAMETERS = {
    "pitchShift": (0.0, 4.0, 1.0),
    "doubleVoice": (0.0, 4.0, 0.0),
    "doubleVoiceLevel": (0.0, 4.0, 0.0),
    "doubleVoiceTimeShift": (0.0, 0.5, 0.0),
    "speed": (50.0, MAX_SPEED, 100.0),
    "defaultVoiceSpeed": (50.0, MAX_SPEED, 100.0),
    "pitch": (50.0, 200.0, 100.0),
    "volume": (0.0, 100.0, 100.0),
    "enableCompression": (0.0, 1.0, 0.0),
    "emph": (0.0, 2.0, 1.0),
    "pauseMiddle": (80.0, 300.0, 150.0),
    "pauseLong": (300.0, 2000.0, 500.0),
    "pauseSentence": (80.0, 10000.0, 800.0),
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
        self._language = PREFERRED
        self._voice_name = LANGUAGES[PREFERRED].voice
        self._dictionary: dict[str, dict[str, str]] = {}
        """Language -> word in lower case -> how it is pronounced."""
        self._volume = 0.55
        self._parameters = {name: default for name, (_, _, default) in _PARAMETERS.items()}
        self._numbers = itertools.count(1)
        self._index = 0
        """Number of the next word of the text that is being said."""
        self._marks: Sequence[tuple[int, int]] = ()
        """The bookmarks of that text."""
        self.synchroTTS = Signal("(m)")
        """Raised at the end of what the robot says, before it listens: [s, us] of sound that is still to be played."""
        self.languageTTS = Signal("(s)")
        """Raised with the locale of a new language."""
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
        said = self.speak(stringToSay, one_of(language or self._language, LANGUAGES, "language"))
        return None if said is None else chained(said, lambda _: None)

    @remote("v(ss)")
    def sayToFile(self, pStringToSay: str, pFileName: str) -> concurrent.futures.Future:
        """Says a text into a .wav or .raw file on the robot's disk: 16 bits, one channel, 22050 Hz (Asian: 16000)."""
        text, style, _ = self._prepare(pStringToSay, self._language)
        target = self._disk.output(pFileName)
        return self._workers.run(self._write, text, style, target, LANGUAGES[self._language].rate)

    @remote("v()")
    def stopAll(self) -> None:
        """Stops the text being said and all that wait."""
        self._voice.stop()

    def speak(self, text: str, language: str | None = None) -> concurrent.futures.Future | None:
        """Queue a text, for other services; the future is done when it has been said (true) or was interrupted (false).
        None for an empty text."""
        text, style, marks = self._prepare(text, language or self._language)
        if not text:
            return None
        if self._voice.waiting() >= MAX_QUEUE:
            raise ServiceError(f"{MAX_QUEUE} texts are already waiting")
        number = next(self._numbers)
        self._announce("Status", [number, "enqueued"])
        said = self._voice.say(text, style, marks, number)
        said.add_done_callback(lambda done: self._announce("Status", [number, _end_of(done)]))
        return chained(said, lambda result: result)

    # --- settings ----------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def setLanguage(self, pLanguage: str) -> None:
        """Sets the language."""
        self._language = one_of(pLanguage, LANGUAGES, "pLanguage")
        self._voice_name = LANGUAGES[pLanguage].voice
        self.languageTTS(LANGUAGES[pLanguage].locale)

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
        return LANGUAGES[one_of(language or self._language, LANGUAGES, "language")].locale

    @remote("v(f)")
    def setVolume(self, volume: float) -> None:
        """Sets the voice's loudness, 0 to 1; what lies outside is as loud or as quiet as can be."""
        self._volume = min(max(volume, 0.0), 1.0)

    @remote("f()")
    def getVolume(self) -> float:
        """Returns the voice's loudness."""
        return self._volume

    @remote("v(sf)")
    def setParameter(self, pEffectName: str, pEffectValue: float) -> None:
        """Sets pitchShift, doubleVoice, doubleVoiceLevel, doubleVoiceTimeShift, speed, pitch or volume."""
        least, greatest, _ = _PARAMETERS[one_of(pEffectName, _PARAMETERS, "pEffectName")]
        self._parameters[pEffectName] = within(pEffectValue, least, greatest, "pEffectValue")
        if pEffectName == "defaultVoiceSpeed":
            self.resetSpeed()

    @remote("f(s)")
    def getParameter(self, pParameterName: str) -> float:
        """Returns a parameter."""
        return self._parameters[one_of(pParameterName, self._parameters, "pParameterName")]

    @remote("v()")
    def resetSpeed(self) -> None:
        """Resets the speed to its default."""
        self._parameters["speed"] = self._parameters["defaultVoiceSpeed"]

    @remote("v(s)")
    def setVoice(self, pVoiceID: str) -> None:
        """Sets the voice, until the language changes."""
        self._voice_name = one_of(pVoiceID, self.getAvailableVoices(), "pVoiceID")

    @remote("s()")
    def getVoice(self) -> str:
        """Returns the voice."""
        return self._voice_name

    @remote("[s]()")
    def getAvailableVoices(self) -> list[str]:
        """Lists the voices, one for each language. espeak-ng speaks in their stead."""
        return [language.voice for language in LANGUAGES.values()]

    @remote("v(ss)")
    def setLanguageDefaultVoice(self, Language: str, Voice: str) -> None:
        """Sets the voice that a language begins with; each has one."""
        one_of(Voice, (LANGUAGES[one_of(Language, LANGUAGES, "Language")].voice,), "Voice")

    @remote("v(s)")
    def loadVoicePreference(self, pPreferenceName: str) -> None:
        """Sets voice and parameters as a file of the robot's preferences says, or as NAOqi's own do."""
        official = pPreferenceName.removeprefix(OFFICIAL_VOICE)
        if official in LANGUAGES:
            self._voice_name = LANGUAGES[official].voice
            self._parameters = {name: default for name, (_, _, default) in _PARAMETERS.items()}
            return
        path = self._disk.path(PREFERENCES.format(pPreferenceName))
        if "/" in pPreferenceName or not path.is_file():
            raise ServiceError(f"there are no voice preferences '{pPreferenceName[:60]}'")
        try:
            entries = ElementTree.parse(path).getroot().iter("Preference")
        except ElementTree.ParseError as error:
            raise ServiceError(f"the voice preferences '{pPreferenceName[:60]}' cannot be read: {error}") from None
        for entry in entries:
            self._prefer(entry.get("name", ""), entry.get("value", ""))

    @remote("v(b)")
    def enableNotifications(self, enable: bool = True) -> None:
        """Switches the events of this service on or off. Ignored: they are always raised."""

    @remote("v()")
    def disableNotifications(self) -> None:
        """Switches the events of this service off. Ignored: they are always raised."""

    @remote("b(ss)")
    def addToDictionary(self, word: str, pronunciation: str) -> bool:
        """Sets how a word is pronounced in the present language."""
        return self._learn(word, pronunciation)

    @remote("b(sssss)", name="addToDictionary")
    def addToDictionaryWithAccent(self, type: str, word: str, priority: str, phonetic: str, accent: str) -> bool:
        """Sets how a Japanese word is pronounced; priority 1 to 9999."""
        if not priority.isdigit() or not 1 <= int(priority) <= 9999:
            raise ServiceError(f"priority must be between 1 and 9999, got '{priority[:20]}'")
        return self._learn(word, phonetic)

    @remote("b(s)")
    def deleteFromDictionary(self, word: str) -> bool:
        """Forgets how a word is pronounced; whether it was known."""
        return self._dictionary.get(self._language, {}).pop(word.lower(), None) is not None

    @remote("b(ss)", name="deleteFromDictionary")
    def deleteFromDictionaryOfType(self, type: str, word: str) -> bool:
        """Forgets how a Japanese word is pronounced; whether it was known."""
        return self.deleteFromDictionary(word)

    @remote("v()")
    def showDictionary(self) -> None:
        """Writes the dictionary of the present language into the log."""
        for word, pronunciation in self._dictionary.get(self._language, {}).items():
            log.info("dictionary of %s: %s is pronounced %s", self._language, word, pronunciation)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _learn(self, word: str, pronunciation: str) -> bool:
        words = self._dictionary.setdefault(self._language, {})
        plain = spoken(pronunciation)
        if not re.fullmatch(r"\w[\w'-]*", word) or not plain or len(words) >= MAX_DICTIONARY:
            return False
        words[word.lower()] = plain
        return True

    def _prefer(self, name: str, value: str) -> None:
        """Take one entry of the voice preferences: the voice, or a parameter."""
        if name == "voice":
            self.setVoice(value)
            return
        try:
            self.setParameter(name, float(value))
        except ValueError:
            raise ServiceError(f"the voice preference {name[:40]} must be a number, got '{value[:20]}'") from None

    def _prepare(self, text: str, language: str) -> tuple[str, SpeechStyle, list[tuple[int, int]]]:
        """Return the text as it is pronounced, the style that tags and settings specify, and the bookmarks."""
        if len(text) > MAX_TEXT:
            raise ServiceError(f"the text has {len(text)} characters; at most {MAX_TEXT} can be said at once")
        shift = self._parameters["pitchShift"]
        pitch = self._parameters["pitch"] * (shift if shift >= 0.5 else 1.0)
        speaker = LANGUAGES[language if language != self._language else language_of(self._voice_name)].speaker
        loudness = self._volume * self._parameters["volume"] / 100.0
        plain, tags = read(text)
        style = styled(SpeechStyle(speaker, self._parameters["speed"], pitch, loudness), tags)
        known = self._dictionary.get(language, {})
        said = re.sub(r"\w[\w'-]*", lambda match: known.get(match.group().lower(), match.group()), plain)
        return said, style, bookmarks(tags)

    def _write(self, text: str, style: SpeechStyle, target: Path, rate: int) -> None:
        samples, synthesised_at = synthesise(text, style)
        moments = np.arange(int(len(samples) * rate / synthesised_at)) / rate * synthesised_at
        samples = np.interp(moments, np.arange(len(samples)), samples).astype(np.float32) * np.float32(style.volume)
        try:
            if target.suffix.lower() == ".raw":
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes((np.clip(samples, -1.0, 1.0) * FULL_SCALE).astype("<i2").tobytes())
            else:
                write_wave(target, samples, rate)
        except OSError as error:
            raise ServiceError(f"'{target.name}' cannot be written: {error.strerror}") from None

    def _begun(self, utterance: Utterance) -> None:
        self._index, self._marks = 0, utterance.bookmarks
        self._announce("TextDone", False)
        self._announce("CurrentSentence", utterance.text)
        self._announce("TextStarted", True)
        self._announce("Status", [utterance.number, "started"])

    def _word(self, word: str, position: int) -> None:
        for mark in [number for index, number in self._marks if index == self._index]:
            self._announce("CurrentBookMark", mark)
        self._announce("CurrentWord", word)
        self._announce("PositionOfCurrentWord", self._index)
        self._index += 1

    def _ended(self, interrupted: bool) -> None:
        for mark in [number for index, number in self._marks if index >= self._index and not interrupted]:
            self._announce("CurrentBookMark", mark)
        self._announce("TextStarted", False)
        self._announce("CurrentWord", "")
        self._announce("CurrentSentence", "")
        if interrupted:
            self._announce("TextInterrupted", True)
        self._announce("TextDone", True)
        if self._voice.waiting() <= 1:  # this one
            self.synchroTTS([0, 0])

    def _announce(self, event: str, value: object) -> None:
        self._memory.announce(f"ALTextToSpeech/{event}", value)


def _end_of(text: concurrent.futures.Future) -> str:
    """Return the last status of a text, which is said, was interrupted, or could not be said."""
    if text.cancelled():
        return "stopped"
    if text.exception() is not None:
        return "thrown"
    return "done" if text.result() else "stopped"
