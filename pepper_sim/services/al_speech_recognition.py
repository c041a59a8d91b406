"""ALSpeechRecognition: settings are stored; there is no recogniser, so no word is ever recognised."""

from __future__ import annotations

from typing import Any

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import ServiceError, finite, one_of, remote
from pepper_sim.naoqi.speech_languages import LANGUAGES
from pepper_sim.services.al_memory import ALMemory


class ALSpeechRecognition(Extractor):
    """Recognises words of a vocabulary."""

    name = "ALSpeechRecognition"
    events = ("WordRecognized", "WordRecognizedAndGrammar", "SpeechDetected", "ALSpeechRecognition/Status")

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._language = "English"
        self._vocabulary: list[str] = []
        self._paused = False
        self._audio_expression = self._visual_expression = True
        self._parameters: dict[str, float] = {"Sensitivity": 0.4}
        memory.store("WordRecognized", [])

    @remote("v([s]b)")
    def setVocabulary(self, vocabulary: list[str], enabledWordSpotting: bool) -> None:
        """Sets the words to listen for. Not while the engine runs: pause it first."""
        if self.active and not self._paused:
            raise ServiceError("a vocabulary cannot be set while the speech recognition runs; pause it first")
        if not vocabulary:
            raise ServiceError("vocabulary must not be empty")
        self._vocabulary = vocabulary

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
    def pause(self, isPaused: bool) -> None:
        """Pauses the recognition."""
        self._paused = isPaused

    @remote("v(b)")
    def setAudioExpression(self, setOrNot: bool) -> None:
        """Switches the sound at the beginning of listening on or off."""
        self._audio_expression = setOrNot

    @remote("b()")
    def getAudioExpression(self) -> bool:
        """Whether the sound at the beginning of listening is on."""
        return self._audio_expression

    @remote("v(b)")
    def setVisualExpression(self, setOrNot: bool) -> None:
        """Switches the LEDs of the eyes while listening on or off."""
        self._visual_expression = setOrNot

    @remote("v(sm)")
    def setParameter(self, paramName: str, paramValue: Any) -> None:
        """Sets a parameter."""
        self._parameters[paramName] = finite(paramValue, "paramValue")

    @remote("f(s)")
    def getParameter(self, paramName: str) -> float:
        """Returns a parameter."""
        return self._parameters[one_of(paramName, self._parameters, "paramName")]

    @remote("v()")
    def removeAllContext(self) -> None:
        """Removes all grammars."""
        self._vocabulary = []
