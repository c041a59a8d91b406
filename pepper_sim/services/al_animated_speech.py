"""ALAnimatedSpeech: speech with gestures.

A text may start animations, "^start(animations/Stand/Gestures/Hey_1) hello"; the first one plays while the text is
said. `pepper_sim.naoqi.motion.gestures` lists those installed; other animations and other tags ^...() are dropped.
"""

from __future__ import annotations

import concurrent.futures
import re
from typing import Any

from pepper_sim.naoqi.motion.gestures import GESTURES
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.services.al_animation_player import ALAnimationPlayer
from pepper_sim.services.al_text_to_speech import ALTextToSpeech

_START = re.compile(r"\^(?:start|run)\(([^)]*)\)")
MODES = ("disabled", "random", "contextual")


class ALAnimatedSpeech(Module):
    """Says texts with body language."""

    name = "ALAnimatedSpeech"

    def __init__(self, speech: ALTextToSpeech, animations: ALAnimationPlayer) -> None:
        self._speech = speech
        self._animations = animations
        self._mode = "contextual"

    @remote("v(s)", "v(sm)")
    def say(self, text: str, configuration: Any = None) -> concurrent.futures.Future | None:
        """Says a text without its tags ^...(); configuration: {"bodyLanguageMode": see setBodyLanguageModeFromStr}."""
        if configuration is not None:
            if not isinstance(configuration, dict | list | tuple):
                raise ServiceError(f"configuration must be a map, got {shown(configuration)}")
            mode = configuration.get("bodyLanguageMode", self._mode) if isinstance(configuration, dict) else self._mode
            one_of(mode, MODES, "bodyLanguageMode")
        started = _START.search(text)
        if started and started.group(1) in GESTURES:
            self._animations.run(started.group(1))
        return self._speech.speak(text)

    @remote("v(i)")
    def setBodyLanguageMode(self, bodyLanguageMode: int) -> None:
        """Sets 0 disabled, 1 random, 2 contextual."""
        self._mode = MODES[one_of(bodyLanguageMode, (0, 1, 2), "bodyLanguageMode")]

    @remote("v(s)")
    def setBodyLanguageModeFromStr(self, stringBodyLanguageMode: str) -> None:
        """Sets "disabled", "random" or "contextual"."""
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
        """Switches gestures on or off."""
        self._mode = "contextual" if enable else "disabled"

    @remote("v(m)")
    def addTagsToWords(self, tagsToWords: Any) -> None:
        """Assigns gestures to words. Ignored."""
