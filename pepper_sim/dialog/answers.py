"""What the robot says: an output with the present variables and concepts, and what else it causes.

A sentence that holds a variable without a value, a condition that is false or a deactivated tag cannot be said; in a
choice the next one is taken. What a sentence causes (variables, tags, focus, calls) is listed in `Answer.effects` and
happens after it has been said.
"""

from __future__ import annotations

import datetime
import random
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from pepper_sim.dialog.matching import Context, compare
from pepper_sim.dialog.nodes import (
    Assignment,
    Choice,
    Comparison,
    Concept,
    Definition,
    Function,
    Node,
    Optional,
    Rule,
    Sequence,
    Tag,
    Topic,
    Variable,
    Word,
    walk,
)

MAX_JUMPS = 20
"""^goto after ^goto; more of them are a circle."""
MAX_NESTING = 30
MAX_PIECES = 20_000
"""Nodes that one answer may evaluate."""
SPOKEN = frozenset(f"{verb}{what}" for verb in ("start", "run", "stop", "wait") for what in ("", "Tag", "Sound")) | {
    "mode",
    "pCall",
    "call",
    "sCall",
}
"""Functions that the animated speech carries out."""
CALLS = ("call", "sCall", "pCall")
_CALL = re.compile(r"\s*([\w.]+)\.(\w+)\s*\((.*)\)\s*$", re.DOTALL)


class Unsayable(Exception):
    """A sentence that cannot be said now."""


@dataclass(frozen=True)
class Effect:
    """Something that an answer causes: "set", "clear", "activate", "scope" and so on, with its arguments."""

    kind: str
    arguments: tuple[Any, ...] = ()


@dataclass
class Answer:
    """What is said, and what it causes, in this order."""

    text: str = ""
    effects: list[Effect] = field(default_factory=list)
    tags: list[str] = field(default_factory=list)


class Speaker(Context, Protocol):
    """What outputs ask for beyond inputs."""

    def turn(self, key: tuple[str, int], count: int) -> int:
        """Return which of `count` items of the choice `key` is next."""

    def took(self, key: tuple[str, int], index: int) -> None:
        """Remember the item that was taken."""

    def definition(self, topic: str, name: str) -> Definition | None:
        """Return a function that a topic defines."""

    def jump(self, function: str, topic: str, arguments: list[str]) -> Rule | None:
        """Return the rule whose output ^goto, ^nextProposal and so on say; None if there is none."""

    def items(self, concept: str) -> list[str]:
        """List what a concept can be."""

    def user_info(self, name: str) -> str | None:
        """Return what is known about the user who speaks."""

    def knowledge(self, function: str, arguments: list[str]) -> str | None:
        """Return what a function of `ASKING` finds, "" if only whether; None if nothing."""


JUMPS = frozenset(
    {"goto", "gotoReactivate", "gotoRandom", "topicTag", "topicTagReactivate", "topic", "topicRandom"}
    | {"nextProposal", "previousProposal", "sameProposal"}
)
_SILENT = frozenset({"activate", "deactivate", "clear", "stayInScope", "stay", "releaseFocus", "switchFocus"}) | {
    "setUserInfo",
    "removeUserInfo",
    "addToConcept",
    "removeFromConcept",
    "clearConcept",
}


REMEMBERING = frozenset({"addKnowledge", "updateKnowledge", "removeKnowledge"}) | {
    "addMetadata",
    "updateMetadata",
    "removeMetadata",
}
"""Functions that change what the robot knows."""
ASKING = frozenset({"containsKnowledge", "queryKnowledge", "getKnowledgeId", "containsMetadata", "queryMetadata"})
"""Functions that ask what the robot knows; with nothing found, the sentence cannot be said."""


_OTHERS = frozenset({"exist", "notExist", "hasUserInfo", "getUserInfo", "isInConcept", "size", "enumerate"}) | {
    "concatenate",
    "empty",
    "break",
    "notContainsKnowledge",
    "notContainsMetadata",
    "addword",
    "replace",
}


class AnswerMaker:
    """Makes one answer.

    Args:
        captures: What the human said where the rule has "_".
    """

    def __init__(
        self, speaker: Speaker, captures: Mapping[int, str], random_numbers: random.Random | None = None
    ) -> None:
        self._speaker = speaker
        self._locals: dict[str, str] = {str(number): text for number, text in captures.items()}
        self._random = random_numbers or random.Random()
        self._answer = Answer()
        self._topic = ""
        self._jumps = 0
        self._depth = 0
        self._count = 0

    def make(self, rule: Rule) -> Answer:
        """Return the answer of a rule.

        Raises: Unsayable: It cannot be said.
        """
        self._topic = rule.topic
        text = "".join(self._pieces(rule.output))
        self._answer.text = re.sub(r"\s+", " ", text).strip()
        return self._answer

    def plain(self, node: Node) -> str:
        """Return a node as it would be said, for a concept's items."""
        return re.sub(r"\s+", " ", "".join(self._pieces(node))).strip()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _pieces(self, node: Node) -> Iterator[str]:
        """Yield the text of a node in pieces, white space included."""
        self._depth += 1
        self._count += 1
        try:
            self._require(self._depth <= MAX_NESTING and self._count <= MAX_PIECES)
            yield from self._one(node)
        finally:
            self._depth -= 1

    def _one(self, node: Node) -> Iterator[str]:
        gap = " " if getattr(node, "spaced", False) else ""
        match node:
            case Word(text=text):
                yield gap + text
            case Sequence(items=items):
                yield gap + "".join(piece for item in items for piece in self._pieces(item)).lstrip()
            case Choice(items=items, order=order, position=position):
                yield gap
                yield from self._choice(items, order, position)
            case Optional(items=items, position=position):
                yield gap
                yield from self._choice((*items, Sequence()), "next", position)
            case Concept(name=name, position=position):
                yield gap
                yield from self._concept(name, position)
            case Variable(name=name):
                yield gap + self._variable(name)
            case Comparison(name=name, operator=operator, value=value):
                if not compare(self._value_of(name), operator, self.plain(value)):
                    raise Unsayable
            case Assignment(name=name, value=value):
                text = self.plain(value)
                self._locals[name] = text
                self._answer.effects.append(Effect("set", (name, text)))
            case Tag(name=name):
                if not self._speaker.tag_active(self._topic, name):
                    raise Unsayable
                self._answer.tags.append(name)
            case Function():
                yield from self._function(node, gap)

    def _choice(self, items: tuple[Node, ...], order: str, position: int) -> Iterator[str]:
        if not items:
            return
        key = (self._topic, position)
        indices = list(range(len(items)))
        if order == "rand":
            self._random.shuffle(indices)
        elif order == "next":
            turn = self._speaker.turn(key, len(items))
            indices = indices[turn:] + indices[:turn]
        for index in indices:
            kept = len(self._answer.effects), len(self._answer.tags), dict(self._locals)
            try:
                text = "".join(self._pieces(items[index]))
            except Unsayable:
                del self._answer.effects[kept[0] :]
                del self._answer.tags[kept[1] :]
                self._locals = kept[2]
                continue
            if order == "next":
                self._speaker.took(key, index)
            yield text.lstrip()
            return
        if order != "firstOptional":
            raise Unsayable

    def _concept(self, name: str, position: int) -> Iterator[str]:
        items = self._speaker.items(name)
        if not items:
            raise Unsayable
        inside = self._speaker.concept(name)
        if inside is not None and any(isinstance(item, Choice) and item.order != "next" for item in inside.items):
            yield from self._pieces(inside)
            return
        key = (self._topic, position)
        index = self._speaker.turn(key, len(items))
        self._speaker.took(key, index)
        yield items[index]

    def _value_of(self, name: str) -> str | None:
        return self._locals[name] if name in self._locals else self._speaker.variable(name)

    def _variable(self, name: str) -> str:
        value = self._value_of(name)
        if not value:
            raise Unsayable
        return value

    def _function(self, node: Function, gap: str) -> Iterator[str]:
        name, texts = node.name, [self._text(argument) for argument in node.texts]
        if name in JUMPS:
            yield from self._jump(name, texts)
        elif name in CALLS:
            self._answer.effects.append(Effect(name, (self._text(node.raw),)))
        elif name in SPOKEN:
            yield f"{gap}^{name}({self._text(node.raw)})"
        elif name in _SILENT:
            self._answer.effects.append(Effect(name, tuple(text.lstrip("~%") for text in texts)))
        elif name in ("exist", "notExist"):
            known = all(self._value_of(text.lstrip("$")) for text in node.texts)
            self._require(known == (name == "exist"))
        elif name in ("hasUserInfo", "getUserInfo"):
            value = self._speaker.user_info(texts[0] if texts else "")
            self._require(value is not None)
            if name == "getUserInfo":
                yield gap + str(value)
        elif name in REMEMBERING:
            self._answer.effects.append(Effect(name, tuple(texts)))
        elif name in ASKING:
            found = self._speaker.knowledge(name, texts)
            self._require(found is not None)
            yield f"{gap}{found}"
        elif name.startswith("notContains"):
            self._require(self._speaker.knowledge("c" + name.removeprefix("notC"), texts) is None)
        elif name in ("isInConcept", "size", "enumerate"):
            yield from self._about_concept(name, texts, gap)
        elif name == "concatenate":
            yield gap + "".join(texts)
        elif name in _MOMENTS:
            yield gap + _MOMENTS[name](datetime.datetime.now())
        elif (definition := self._speaker.definition(self._topic, name)) is not None:
            yield gap
            yield from self._defined(definition, node)
        else:
            self._require(name in ("empty", "break"))

    def _jump(self, name: str, texts: list[str]) -> Iterator[str]:
        self._jumps += 1
        if self._jumps > MAX_JUMPS:
            raise Unsayable
        rule = self._speaker.jump(name, self._topic, [text.lstrip("%~") for text in texts])
        if rule is None:
            if name == "topic":
                self._answer.effects.append(Effect("focus", (texts[0] if texts else "",)))
            return
        self._answer.effects.append(Effect("scope", (rule,)))
        topic, self._topic = self._topic, rule.topic
        yield from self._pieces(rule.output)
        self._topic = topic

    def _about_concept(self, name: str, texts: list[str], gap: str) -> Iterator[str]:
        items = self._speaker.items(texts[0].lstrip("~") if texts else "")
        if name == "size":
            yield f"{gap}{len(items)}"
        elif name == "isInConcept":
            self._require(len(texts) > 1 and texts[1].lower() in [item.lower() for item in items])
        else:
            count = int(texts[1]) if len(texts) > 1 and texts[1].isdigit() else len(items)
            key = (f"^enumerate {texts[0] if texts else ''}", count)
            start = self._speaker.turn(key, max(1, len(items)))
            shown = items[start : start + max(1, count)]
            if shown:
                self._speaker.took(key, (start + len(shown) - 1) % len(items))
            yield gap + " ".join(shown)

    def _defined(self, definition: Definition, node: Function) -> Iterator[str]:
        values = [self.plain(argument) for argument in node.arguments]
        kept = dict(self._locals)
        self._locals.update(zip(definition.parameters, values, strict=False))
        text = "".join(self._pieces(definition.output))
        for parameter in definition.parameters:
            self._locals.pop(parameter, None)
            if parameter in kept:
                self._locals[parameter] = kept[parameter]
        yield text

    def _text(self, raw: str) -> str:
        """Return a function's argument with its variables replaced.

        Raises: Unsayable: One of them has no value.
        """
        return re.sub(r"\$(\w+(?:/\w+)*)", lambda match: self._variable(match.group(1)), raw)

    def _require(self, holds: bool) -> None:
        if not holds:
            raise Unsayable


def unknown_functions(topic: Topic) -> list[str]:
    """List the functions in a topic's outputs that nobody carries out; sentences with them are not said."""
    known = JUMPS | SPOKEN | _SILENT | REMEMBERING | ASKING | set(_MOMENTS) | set(topic.definitions) | _OTHERS
    used = {node.name for rule in topic.all_rules() for node in walk(rule.output) if isinstance(node, Function)}
    return sorted(used - known)


def call_of(text: str) -> tuple[str, str, list[Any]] | None:
    """Return service, method and arguments of a call, "ALMotion.rest()"; None if it is not written like that."""
    found = _CALL.match(text)
    if found is None:
        return None
    arguments: list[Any] = []
    for part in re.findall(r"\"[^\"]*\"|[^,]+", found.group(3)):
        part = part.strip()
        if part:
            arguments.append(_literal(part))
    return found.group(1), found.group(2), arguments


def _literal(text: str) -> Any:
    if text.startswith('"'):
        return text.strip('"')
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text.strip("'")


def _end_of_week(now: datetime.datetime) -> str:
    return f"{now + datetime.timedelta(days=6 - now.weekday()):%Y-%m-%d}"


_MOMENTS = {
    "currentDateTime": lambda now: f"{now:%Y-%m-%d %H:%M}",
    "currentDate": lambda now: f"{now:%Y-%m-%d}",
    "currentTime": lambda now: f"{now:%H:%M}",
    "endOfWeek": _end_of_week,
}
