"""ALAnimatedSpeech: speech with gestures. The words are said; no animation is installed to gesture with."""

from __future__ import annotations

import concurrent.futures
from typing import Any

from pepper_sim.services.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.services.text_to_speech import ALTextToSpeech

MODES = ("disabled", "random", "contextual")


class ALAnimatedSpeech(Module):
    """Says texts with body language."""

    name = "ALAnimatedSpeech"

    def __init__(self, speech: ALTextToSpeech) -> None:
        self._speech = speech
        self._mode = "contextual"

    @remote("v(s)", "v(sm)")
    def say(self, text: str, configuration: Any = None) -> concurrent.futures.Future | None:
        """Says a text without its tags ^...(); configuration: {"bodyLanguageMode": see setBodyLanguageModeFromStr}."""
        if configuration is not None:
            if not isinstance(configuration, dict | list | tuple):
                raise ServiceError(f"configuration must be a map, got {shown(configuration)}")
            mode = configuration.get("bodyLanguageMode", self._mode) if isinstance(configuration, dict) else self._mode
            one_of(mode, MODES, "bodyLanguageMode")
        return self._speech.speak(text)

    @remote("v(i)")
    def setBodyLanguageMode(self, bodyLanguageMode: int) -> None:
        """Chooses 0 disabled, 1 random, 2 contextual."""
        self._mode = MODES[one_of(bodyLanguageMode, (0, 1, 2), "bodyLanguageMode")]

    @remote("v(s)")
    def setBodyLanguageModeFromStr(self, stringBodyLanguageMode: str) -> None:
        """Chooses "disabled", "random" or "contextual"."""
        self._mode = one_of(stringBodyLanguageMode, MODES, "stringBodyLanguageMode")

    @remote("i()")
    def getBodyLanguageMode(self) -> int:
        """Returns 0 disabled, 1 random, 2 contextual."""
        return MODES.index(self._mode)

    @remote("s()")
    def getBodyLanguageModeToStr(self) -> str:
        """Returns "disabled", "random" or "contextual"."""
        return self._mode

    @remote("b()")
    def isBodyTalkEnabled(self) -> bool:
        """Whether gestures are on."""
        return self._mode != "disabled"

    @remote("v(b)")
    def setBodyTalkEnabled(self, enable: bool) -> None:
        """Switches gestures."""
        self._mode = "contextual" if enable else "disabled"

    @remote("v(m)")
    def addTagsToWords(self, tagsToWords: Any) -> None:
        """Teaches which words go with which gestures. Ignored."""
