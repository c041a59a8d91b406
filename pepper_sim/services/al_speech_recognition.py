"""ALSpeechRecognition: what people in the room say, against a vocabulary or the rules of a grammar.

The robot is given the text of what is said (`Room.spoken`); nothing is recognised from samples, so every result has
the same confidence. The result comes at the end of the sentence.
Source: NAOqi 2.8 documentation, ALSpeechRecognition.
"""

from __future__ import annotations

import concurrent.futures
import time
from collections.abc import Callable
from typing import Any

from pepper_sim.dialog.matching import words_of
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.recognition_contexts import RecognitionContexts
from pepper_sim.naoqi.service import ServiceError, finite, one_of, remote, within
from pepper_sim.naoqi.speech_languages import LANGUAGES, PREFERRED
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.sound.room import Room, Sound

CONFIDENCE = 0.6
"""Confidence of every result: above the usual thresholds, 0.3 to 0.5."""
NOTHING: list[Any] = ["", -3.0]
"""WordRecognized while no word is recognised, as robots show it."""
GARBAGE = "<...>"
"""Stands for the words around a phrase that was spotted."""


class ALSpeechRecognition(Extractor):
    """Recognises words of a vocabulary."""

    name = "ALSpeechRecognition"
    events = (
        "WordRecognized",
        "WordRecognizedAndGrammar",
        "LastWordRecognized",
        "SpeechDetected",
        "ALSpeechRecognition/ActiveListening",
        "ALSpeechRecognition/IsRunning",
        "ALSpeechRecognition/Status",
    )

    def __init__(self, memory: ALMemory, room: Room, disk: RobotDisk, alarm: Alarm) -> None:
        super().__init__(memory)
        self._alarm = alarm
        self._language = PREFERRED
        self._vocabulary: list[str] = []
        self._spotting = False
        self._contexts = RecognitionContexts(disk)
        self._paused = False
        self._for_dialog = False
        self._running = False
        self._audio_expression = self._visual_expression = True
        self._parameters: dict[str, float] = {"Sensitivity": 0.4, "NbHypotheses": 1.0}
        self._listeners: list[Callable[[str], None]] = []
        for event, value in (
            ("WordRecognized", NOTHING),
            ("SpeechDetected", False),
            ("ALSpeechRecognition/Status", "Idle"),
        ):
            memory.store(event, value)
        room.on_speech(self._begin)

    def parts(self) -> tuple[Any, ...]:
        return self, self._contexts

    @property
    def running(self) -> bool:
        """Whether the robot listens."""
        return self._running

    def on_sentence(self, listener: Callable[[str], None]) -> None:
        """Call `listener(text)` at the end of every sentence that the robot listens to."""
        self._listeners.append(listener)

    def serve_dialog(self, wanted: bool) -> None:
        """Listen for the dialogue, without a vocabulary, or no more."""
        self._for_dialog = wanted
        self._report_running()

    # --- what to listen for ------------------------------------------------------------------------------------------

    @remote("v([s]b)")
    def setVocabulary(self, vocabulary: list[str], enabledWordSpotting: bool) -> None:
        """Sets the words to listen for, alone or anywhere in a sentence. Not while the engine runs: pause it first."""
        self._stopped("a vocabulary cannot be set")
        if not vocabulary or not all(words_of(phrase) for phrase in vocabulary):
            raise ServiceError("vocabulary must not be empty, and each of its phrases must hold a word")
        self._vocabulary, self._spotting = vocabulary, enabledWordSpotting

    @remote("v([s])")
    def setWordListAsVocabulary(self, vocabulary: list[str]) -> None:
        """Older name of setVocabulary without word spotting."""
        self.setVocabulary(vocabulary, False)

    @remote("v(s)")
    def loadVocabulary(self, pathToGrammarfile: str) -> None:
        """Listens for a compiled grammar on the robot's disk, and for nothing else."""
        self._stopped("a vocabulary cannot be loaded")
        self._contexts.only(pathToGrammarfile)
        self._vocabulary = []

    @remote("v()")
    def removeAllContext(self) -> None:
        """Removes all grammars, and the vocabulary."""
        self._contexts.clear()
        self._vocabulary = []

    @remote("v(b)")
    def pause(self, isPaused: bool) -> None:
        """Stops the recognition, or starts it again."""
        self._paused = isPaused
        self._report_running()

    @remote("v(s)", "v(sif)")
    def subscribe(self, name: str, period: int = 30, precision: float = 1.0) -> None:
        """Starts the recognition for a program."""
        super().subscribe(name, period, precision)
        self._report_running()

    @remote("v(s)")
    def unsubscribe(self, name: str) -> None:
        """Ends the recognition for a program."""
        super().unsubscribe(name)
        self._report_running()

    # --- settings ----------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def setLanguage(self, languageName: str) -> None:
        """Sets the language."""
        self._language = one_of(languageName, LANGUAGES, "languageName")

    @remote("s()")
    def getLanguage(self) -> str:
        """Returns the language."""
        return self._language

    @remote("[s]()")
    def getAvailableLanguages(self) -> list[str]:
        """Lists the languages."""
        return list(LANGUAGES)

    @remote("v(b)")
    def setAudioExpression(self, setOrNot: bool) -> None:
        """Switches the sound at the beginning of listening on or off. Without effect, as since NAOqi 2.7."""
        self._audio_expression = setOrNot

    @remote("b()")
    def getAudioExpression(self) -> bool:
        """Whether the sound at the beginning of listening is on."""
        return self._audio_expression

    @remote("v(b)")
    def setVisualExpression(self, setOrNot: bool) -> None:
        """Switches the LEDs of the eyes while listening on or off. Without effect, as since NAOqi 2.7."""
        self._visual_expression = setOrNot

    @remote("v(sf)")
    def setParameter(self, paramName: str, paramValue: float) -> None:
        """Sets Sensitivity, 0 to 1, or NbHypotheses, the number of results."""
        one_of(paramName, self._parameters, "paramName")
        if paramName == "Sensitivity":
            within(paramValue, 0.0, 1.0, "paramValue")
        else:
            within(paramValue, 1.0, 100.0, "paramValue")
        self._parameters[paramName] = finite(paramValue, "paramValue")

    @remote("f(s)")
    def getParameter(self, paramName: str) -> float:
        """Returns a parameter."""
        return self._parameters[one_of(paramName, self._parameters, "paramName")]

    # --- inside ------------------------------------------------------------------------------------------------------

    def _stopped(self, refusal: str) -> None:
        if self.active and not self._paused:
            raise ServiceError(f"{refusal} while the speech recognition runs; pause it first")

    def _report_running(self) -> None:
        running = (self.active or self._for_dialog) and not self._paused
        if running != self._running:
            self._running = running
            self.memory.announce("ALSpeechRecognition/IsRunning", running)
            self.memory.announce("ALSpeechRecognition/ActiveListening", running)
            self.memory.announce("ALSpeechRecognition/Status", "ListenOn" if running else "Stop")

    def _begin(self, text: str, sound: Sound) -> None:
        """Listen to a sentence until its end. Sensitivity 0 hears nothing."""
        if self._running and self._parameters["Sensitivity"] > 0.0:
            self.memory.announce("SpeechDetected", True)
            self.memory.announce("ALSpeechRecognition/Status", "SpeechDetected")
            end = self._alarm.after(sound.end - time.monotonic())
            end.add_done_callback(lambda done: self._end(text, done))

    def _end(self, text: str, done: concurrent.futures.Future) -> None:
        if done.cancelled() or not self._running:
            return
        self.memory.announce("SpeechDetected", False)
        self.memory.announce("ALSpeechRecognition/Status", "EndOfProcess")
        if self.active:
            self._report(self._results(text))
        self.memory.announce("ALSpeechRecognition/Status", "ListenOn")
        for listener in self._listeners:
            listener(text)

    def _results(self, text: str) -> list[tuple[str, str]]:
        """Return the phrases that match, with the names of their grammars, the longest first."""
        said = words_of(text)
        found = [(phrase, "modifiable_grammar") for phrase in self._vocabulary if self._matches(words_of(phrase), said)]
        found.sort(key=lambda result: -len(words_of(result[0])))
        if self._spotting:
            found = [(f"{GARBAGE} {phrase} {GARBAGE}", grammar) for phrase, grammar in found]
        return [*found, *self._contexts.results(text)][: int(self._parameters["NbHypotheses"])]

    def _matches(self, phrase: tuple[str, ...], said: tuple[str, ...]) -> bool:
        return _place(phrase, said) is not None if self._spotting else phrase == said

    def _report(self, results: list[tuple[str, str]]) -> None:
        if results:
            plain = [part for phrase, _ in results for part in (phrase, CONFIDENCE)]
            self.memory.announce("WordRecognized", plain)
            self.memory.announce("LastWordRecognized", plain)
            named = [part for phrase, grammar in results for part in (phrase, CONFIDENCE, grammar)]
            self.memory.announce("WordRecognizedAndGrammar", named)
        else:
            self.memory.announce("WordRecognized", NOTHING)


def _place(phrase: tuple[str, ...], said: tuple[str, ...]) -> int | None:
    """Return where a phrase stands in what was said; None if it does not."""
    return next((at for at in range(len(said) - len(phrase) + 1) if said[at : at + len(phrase)] == phrase), None)
