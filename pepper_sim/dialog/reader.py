"""Reads a topic's text, or says in which line and column it cannot be read.

A topic is a list of statements, each of which begins a line: "topic:", "language:", "u:", "u1:", "proposal:" and so
on. What belongs to a statement reaches to the next one; "#" begins a comment.
"""

from __future__ import annotations

import bisect
import re

from pepper_sim.dialog.nodes import Definition, Rule, Sequence, Topic, TopicError
from pepper_sim.dialog.sentences import SentenceReader

MAX_CHARACTERS = 2_000_000
CODES = {
    "arw": "Arabic",
    "czc": "Czech",
    "dad": "Danish",
    "dun": "Dutch",
    "enu": "English",
    "fif": "Finnish",
    "frf": "French",
    "ged": "German",
    "grg": "Greek",
    "iti": "Italian",
    "jpj": "Japanese",
    "kok": "Korean",
    "mnc": "Chinese",
    "mnt": "MandarinTaiwan",
    "non": "Norwegian",
    "plp": "Polish",
    "ptb": "Brazilian",
    "ptp": "Portuguese",
    "rur": "Russian",
    "spe": "Spanish",
    "sws": "Swedish",
    "trt": "Turkish",
}
"""QiChat's code of a language -> NAOqi's name."""

_STATEMENT = re.compile(
    r"^[ \t]*(topic|language|include|description|overload|pronunciation|concept|dynamic|proposal|def|recover"
    r"|[uce][0-9]{0,2}|[ls])[ \t]*:",
    re.IGNORECASE | re.MULTILINE,
)
_COMMENT = re.compile(r"#[^\n]*")
_TOPIC = re.compile(r"\s*~\s*([\w.-]+)\s*((?:\^\w+\s*)*)(?:\([^()]*\))?\s*$")
_NAME = re.compile(r"[\w./-]+")
_DEFINITION = re.compile(r"\s*(\w+)\s*\(([^()]*)\)")


def language_name(text: str) -> str | None:
    """Return NAOqi's name of a language, given its name or its code; None if there is no such language."""
    names = {name.lower(): name for name in CODES.values()} | CODES
    return names.get(text.strip().lower())


def read_topic(text: str) -> Topic:
    """Read a topic.

    Raises:
        TopicError: It is not one; the text names line and column.
    """
    return _TopicReader(text).read()


class _TopicReader:
    def __init__(self, text: str) -> None:
        text = text.removeprefix("\ufeff").replace("\r\n", "\n")
        self._text = _COMMENT.sub(lambda match: " " * len(match.group()), text)
        self._line_starts = [0, *(match.end() for match in re.finditer("\n", self._text))]
        self._open: list[Rule] = []
        """The last rule of each level, from 0 on."""

    def read(self) -> Topic:
        if len(self._text) > MAX_CHARACTERS:
            raise TopicError(f"the topic has more than {MAX_CHARACTERS} characters", 1, 1)
        starts = list(_STATEMENT.finditer(self._text))
        first = re.search(r"\S", self._text)
        if not starts or first is None or starts[0].start(1) != first.start() or starts[0].group(1).lower() != "topic":
            raise self._error("a topic must begin with 'topic: ~name()'", first.start() if first else 0)
        ends = [match.start() for match in starts[1:]] + [len(self._text)]
        topic = Topic(self._topic_name(starts[0].end(), ends[0]))
        topic.properties = frozenset(re.findall(r"\^(\w+)", self._text[starts[0].end() : ends[0]]))
        for match, end in zip(starts[1:], ends[1:], strict=True):
            self._statement(topic, match.group(1).lower(), match.start(1), match.end(), end)
        for rule in topic.all_rules():
            rule.topic = topic.name
        return topic

    def _topic_name(self, start: int, end: int) -> str:
        found = _TOPIC.match(self._text, start, end)
        if found is None:
            raise self._error("a topic's name must be written '~name()'", self._visible(start, end))
        return found.group(1)

    def _statement(self, topic: Topic, word: str, at: int, start: int, end: int) -> None:
        body = self._text[start:end].strip()
        if word == "topic":
            raise self._error("a topic has one name only", at)
        if word == "language":
            language = language_name(body)
            if language is None:
                raise self._error(f"there is no language {body[:40]!r}", self._visible(start, end))
            topic.language = language
        elif word == "include":
            topic.includes.append(self._needed(body, "a file's name is missing after 'include:'", at))
        elif word == "description":
            topic.description = body
        elif word == "overload":
            topic.overload = body.lstrip("~")
        elif word == "dynamic":
            topic.dynamics.append(self._name(start, end, "a dynamic concept's name is missing"))
        elif word == "concept":
            self._concept(topic, start, end)
        elif word == "def":
            self._definition(topic, start, end)
        elif word not in ("pronunciation", "recover"):
            self._rule(topic, word, at, start, end)

    def _concept(self, topic: Topic, start: int, end: int) -> None:
        opening = self._visible(start, end)
        if self._text[opening : opening + 1] != "(":
            raise self._error("a concept must be written 'concept:(name) words'", opening)
        closing = self._text.find(")", opening, end)
        if closing < 0:
            raise self._error("')' is missing for this '('", opening)
        name = self._name(opening + 1, closing, "a concept's name is missing")
        topic.concepts[name] = SentenceReader(self._text, closing + 1, end, self._error, "concept").all()

    def _definition(self, topic: Topic, start: int, end: int) -> None:
        found = _DEFINITION.match(self._text, start, end)
        if found is None:
            raise self._error("a function must be written 'def:name($a, $b) output'", self._visible(start, end))
        parameters = tuple(part.strip().lstrip("$") for part in found.group(2).split(",") if part.strip())
        output = SentenceReader(self._text, found.end(), end, self._error, "output").all()
        topic.definitions[found.group(1)] = Definition(parameters, output)

    def _rule(self, topic: Topic, word: str, at: int, start: int, end: int) -> None:
        kind = "proposal" if word == "proposal" else word[0]
        level = int(word[1:] or 0) if kind in "uce" else 0
        if kind in ("c", "e") and level == 0:
            raise self._error(f"'{word}:' needs a level, '{kind}1:'", at)
        source, pattern, properties = "", None, frozenset[str]()
        if kind not in ("proposal", "e"):
            reader = SentenceReader(self._text, start, end, self._error, "input")
            properties = reader.properties()
            source, pattern = reader.in_parentheses()
            start = reader.at
        output = SentenceReader(self._text, start, end, self._error, "output").all()
        line = bisect.bisect_right(self._line_starts, at)
        rule = Rule(kind, level, pattern, output, source, line, properties)
        self._place(topic, rule, word, at)

    def _place(self, topic: Topic, rule: Rule, word: str, at: int) -> None:
        if rule.kind in ("l", "s"):
            topic.rules.append(rule)
            return
        if rule.level > len(self._open):
            raise self._error(f"'{word}:' needs a rule of level {rule.level - 1} before it", at)
        (self._open[rule.level - 1].scope if rule.level else topic.rules).append(rule)
        self._open[rule.level :] = [rule]

    def _name(self, start: int, end: int, missing: str) -> str:
        found = re.compile(r"\s*~?(" + _NAME.pattern + r")\s*$").match(self._text, start, end)
        if found is None:
            raise self._error(missing, self._visible(start, end))
        return found.group(1)

    def _needed(self, body: str, missing: str, at: int) -> str:
        if not body:
            raise self._error(missing, at)
        return body

    def _visible(self, start: int, end: int) -> int:
        """Return the position of the first character from `start` on that is no white space."""
        found = re.compile(r"\S").search(self._text, start, end)
        return found.start() if found else start

    def _error(self, text: str, at: int) -> TopicError:
        line = bisect.bisect_right(self._line_starts, at)
        return TopicError(text, line, at - self._line_starts[line - 1] + 1)


def read_sentence(text: str) -> Sequence:
    """Read one entry of a concept, such as an item that a program sets.

    Raises: TopicError: See `read_topic`.
    """
    return SentenceReader(text, 0, len(text), lambda problem, at: TopicError(problem, 1, at + 1), "concept").all()
