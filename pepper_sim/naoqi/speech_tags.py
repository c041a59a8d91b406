r"""The speech engine's tags in a text, such as \rspd=80\; some programs write two backslashes at either end.

Any client may send any text, and Python matches a pattern without letting another thread run. So no pattern here may
take a second look at what it has passed: a text of 20 000 characters is read in the time of ten with 2000.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from pepper_sim.sound.speech import MAX_SPEED, MIN_SPEED, SpeechStyle, words

_TAG = re.compile(r"(?P<mark>\\{1,2})\s*(?P<name>[A-Za-z]+)\s*(?:=(?P<value>[^\\]*))?(?P=mark)")
"""It ends with as many backslashes as it begins with, because tags stand side by side: \\rspd=80\\\\vct=120\\."""
_ANIMATION = re.compile(r"\^\w+\([^)^]*\)")
"""What ALAnimatedSpeech carries out, and ALTextToSpeech drops."""
_STYLE = ("rspd", "vct", "vol")
MIN_PITCH, MAX_PITCH = 50.0, 200.0
"""Lowest and highest voice [%]. Source: QiSDK documentation, Mastering pronunciation, More TTS tags."""
_MAX_DIGITS = 9
"""Digits of a bookmark, which the event carries as a number of 32 bits."""


@dataclass(frozen=True)
class Tag:
    """A tag of a text: its name in lower case, its value ("" without one) and how many words are before it."""

    name: str
    value: str
    words_before: int


def read(text: str) -> tuple[str, list[Tag]]:
    """Return the words of a text as they are said, with a comma for a pause, and its tags."""
    text = _ANIMATION.sub(" ", text)
    parts: list[str] = []
    tags: list[Tag] = []
    position = before = 0
    for match in _TAG.finditer(text):
        part, name = text[position : match.start()], match["name"].lower()
        before += len(words(part))
        parts += part, ", " if name == "pau" else " "
        tags.append(Tag(name, (match["value"] or "").strip(), before))
        position = match.end()
    parts.append(text[position:])
    return _plain("".join(parts)), tags


def spoken(text: str) -> str:
    """Return the words of a text without the tags."""
    return _plain(_TAG.sub(" ", text))


def lasting_tags(text: str) -> str:
    r"""Return the tags of a text that hold for what follows it, too: those of the style, such as "\rspd=80\", after the
    last reset. A bookmark or a pause has its place."""
    tags = list(_TAG.finditer(text))
    reset = max((number for number, tag in enumerate(tags) if tag["name"].lower() == "rst"), default=-1)
    return "".join(tag.group() for tag in tags[reset + 1 :] if tag["name"].lower() in _STYLE)


def bookmarks(tags: list[Tag]) -> list[tuple[int, int]]:
    r"""Return the bookmarks among tags, \mrk=7\: how many words are before each, and its number."""
    marks = [tag for tag in tags if tag.name == "mrk" and tag.value.isdecimal() and len(tag.value) <= _MAX_DIGITS]
    return [(tag.words_before, int(tag.value)) for tag in marks]


def styled(default: SpeechStyle, tags: list[Tag]) -> SpeechStyle:
    """Return the style after all tags. A value beyond what the voice can do is as much as it can: a text is said, and
    not refused in the middle of what a program or a conversation has to say."""
    style = default
    for tag in tags:
        style = default if tag.name == "rst" else _changed(style, tag)
    return style


def _plain(text: str) -> str:
    """Return a text without the backslashes that belong to no tag, which no engine pronounces, and single spaces."""
    return " ".join(text.replace("\\", " ").split())


def _changed(style: SpeechStyle, tag: Tag) -> SpeechStyle:
    if not tag.value.isdecimal():
        return style
    number = float(tag.value)
    if tag.name == "rspd":
        return replace(style, speed=min(max(number, MIN_SPEED), MAX_SPEED))
    if tag.name == "vct":
        return replace(style, pitch=min(max(number, MIN_PITCH), MAX_PITCH))
    if tag.name == "vol":
        return replace(style, volume=min(number, 100.0) / 100.0)
    return style
