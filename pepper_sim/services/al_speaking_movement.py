"""ALSpeakingMovement: body language while the robot speaks with ALAnimatedSpeech.

Source: NAOqi 2.8 documentation, ALSpeakingMovement. In mode "contextual" a word of the text that is linked with a tag
is accompanied by an animation of that tag; elsewhere, and in mode "random", by short neutral ones. Any other motion of
the joints has precedence.
"""

from __future__ import annotations

import bisect
import random
import re
from collections.abc import Mapping
from typing import Any

from pepper_sim.animations import library
from pepper_sim.animations.accompaniment import Accompaniment
from pepper_sim.naoqi.autonomous_ability import AutonomousAbility
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.service import ServiceError, one_of, remote, shown
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.robot import Pepper
from pepper_sim.services.al_animation_player import ALAnimationPlayer
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.sound.speech import words as spoken_words

MODES = ("random", "contextual")
NEUTRAL = "body language"
"""The tag of the animations that fit every text."""
WORDS: Mapping[str, str] = {
    "self": "I me my mine myself",
    "user": "you your yours yourself",
    "group": "we us our ours everybody together",
    "people": "he him his she her they them their somebody",
    "overall": "all everything every always whole",
    "global": "world around everywhere",
    "affirmative": "yes yeah okay sure right",
    "refusal": "no never cannot can't don't won't not nothing",
    "hello": "hello hi hey bye goodbye welcome",
    "hesitation": "maybe perhaps think guess hmm",
    "not know": "unknown idea wonder",
    "interrogative": "what who where when why how which ?",
    "exclamation": "!",
    "joy": "great happy wonderful fantastic glad love",
    "disappointment": "sad sorry unfortunately pity bad",
    "comparison": "or versus other rather",
    "diversity": "many different some several",
    "shortrange": "here this these near now",
    "longrange": "there that those far",
    "top": "up above high sky top",
    "anterior": "before behind past yesterday ago",
    "tablet": "tablet screen",
    "please": "please",
}
"""Tag -> words that are linked with it from the start; English, and our own choice."""
_AHEAD = 7
"""An animation may begin this many words before its word."""
_WORD = re.compile(r"[\w'’]+|[?!]")


class ALSpeakingMovement(AutonomousAbility):
    """Movements while the robot speaks."""

    name = "ALSpeakingMovement"
    enabled_at_start = True

    def __init__(
        self,
        robot: Pepper,
        joints: MotionJoints,
        alarm: Alarm,
        memory: ALMemory,
        animations: ALAnimationPlayer,
    ) -> None:
        super().__init__()
        self._memory = memory
        self._animations = animations
        self._accompaniment = Accompaniment(robot, joints, alarm, "SpeakingMovement")
        self._random = random.Random()
        self._mode = "contextual"
        self._added: dict[str, str] = {}

    def close(self) -> None:
        self._accompaniment.close()

    @property
    def running(self) -> bool:
        return self._accompaniment.active

    @remote("v(s)")
    def setMode(self, mode: str) -> None:
        """Sets "random" or "contextual" gestures."""
        self._mode = one_of(mode, MODES, "mode")

    @remote("s()")
    def getMode(self) -> str:
        """Returns "random" or "contextual"."""
        return self._mode

    @remote("v(m)")
    def addTagsToWords(self, tagsToWords: Any) -> None:
        """Links words with tags of animations: {tag: [word, ...]}."""
        if not isinstance(tagsToWords, Mapping):
            raise ServiceError(f"tagsToWords must be a map, got {shown(tagsToWords)}")
        links = {}
        for tag, words in tagsToWords.items():
            if not isinstance(tag, str) or not isinstance(words, list | tuple):
                raise ServiceError(f"tagsToWords must be {{tag: [word, ...]}}, got {shown(tag)}: {shown(words)}")
            if not all(isinstance(word, str) for word in words):
                raise ServiceError(f"tagsToWords must be {{tag: [word, ...]}}, got {shown(tag)}: {shown(words)}")
            links.update({word.lower(): tag for word in words})
        self._added = {**self._added, **links}

    @remote("v()")
    def resetTagsToWords(self) -> None:
        """Removes the links that addTagsToWords made."""
        self._added = {}

    # --- for the animated speech -------------------------------------------------------------------------------------

    def begin(self, text: str, mode: str = "") -> None:
        """Accompany a text from now on, which is about to be said; `mode` is for this text only."""
        marks = self._marks(text) if (mode or self._mode) == "contextual" else []
        self._accompaniment.begin(lambda: self._choose(text, marks))

    def end(self) -> None:
        """Stop moving, and go back to where the joints were."""
        self._accompaniment.end()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _marks(self, text: str) -> list[tuple[int, str]]:
        """Return the words in the text that are linked with a tag, a question mark with the word before it: number, as
        ALTextToSpeech counts words, and tag."""
        starts = [start for _, start in spoken_words(text)]
        marks = []
        for match in _WORD.finditer(text):
            word = match.group()
            tag = self._added.get(word.lower()) or _LINKS.get(word.lower())
            if tag is not None and self._animations.tagged(tag):
                marks.append((max(0, bisect.bisect_right(starts, match.start()) - 1), tag))
        return marks

    def _choose(self, text: str, marks: list[tuple[int, str]]) -> str:
        """Return the next animation: that of the next linked word, if it is near, else a neutral one."""
        said = self._memory.read("ALTextToSpeech/PositionOfCurrentWord")
        position = said if isinstance(said, int) and self._memory.read("ALTextToSpeech/CurrentWord") else 0
        while marks and marks[0][0] < position:
            marks.pop(0)
        if marks and marks[0][0] <= position + _AHEAD:
            return self._of_tag(marks.pop(0)[1])
        return self._of_tag(NEUTRAL)

    def _of_tag(self, tag: str) -> str:
        own = [path for path in self._animations.tagged(tag) if library.has(path)]
        return self._random.choice(own or self._animations.tagged(NEUTRAL))


_LINKS = {word.lower(): tag for tag, words in WORDS.items() for word in words.split()}
