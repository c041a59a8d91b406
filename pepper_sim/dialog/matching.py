"""What a human says, against the inputs of rules.

An input matches anywhere in what is said: "hello robot" matches u:(hello), unless the rule is ^exact. Of several rules
the one that explains most of the words is the best.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from pepper_sim.dialog.nodes import (
    Assignment,
    Capture,
    Choice,
    Comparison,
    Concept,
    Event,
    Forbidden,
    Function,
    Node,
    Optional,
    Repeat,
    Rule,
    Sequence,
    Tag,
    Variable,
    Wildcard,
    Word,
    walk,
)

MAX_WORDS = 100
"""Only this many words of an utterance count, the first ones."""
MAX_NESTING = 12
"""Concepts inside concepts; one that contains itself ends here."""
MAX_REPEATS = 10
MAX_STEPS = 200_000
"""Steps that the match of one rule may take; one that needs more does not match."""
_WORD = re.compile(r"[\u3040-\u30ff\u3400-\u9fff]|(?:(?![\u3040-\u30ff\u3400-\u9fff])[\w'])+")


class Context(Protocol):
    """What inputs and outputs ask for while they are evaluated."""

    def variable(self, name: str) -> str | None:
        """Return a variable as text; None if it is not set."""

    def concept(self, name: str) -> Sequence | None:
        """Return what a concept holds; None if there is none of that name."""

    def tag_active(self, topic: str, tag: str) -> bool:
        """Whether rules and sentences with a tag may be used."""


@dataclass(frozen=True)
class Utterance:
    """A sentence cut into words, and the events that count with it.

    Attributes:
        text: As it was said.
        words: Lower case, without punctuation.
        spans: Where each word stands in `text`.
    """

    text: str
    words: tuple[str, ...] = ()
    spans: tuple[tuple[int, int], ...] = ()
    events: frozenset[str] = frozenset()

    @classmethod
    def of(cls, text: str, events: Iterable[str] = ()) -> Utterance:
        text = text.replace("’", "'")
        found = list(_WORD.finditer(text))[:MAX_WORDS]
        words = tuple(match.group().lower().strip("'") for match in found)
        kept = [index for index, word in enumerate(words) if word]
        spans = tuple(found[index].span() for index in kept)
        return cls(text, tuple(words[index] for index in kept), spans, frozenset(events))

    def part(self, start: int, end: int) -> str:
        """Return the words from `start` to before `end` as they were said."""
        return self.text[self.spans[start][0] : self.spans[end - 1][1]] if start < end else ""


def words_of(text: str) -> tuple[str, ...]:
    """Return the words of a text: lower case, without punctuation."""
    return Utterance.of(text).words


@dataclass(frozen=True)
class Match:
    """A rule that matches.

    Attributes:
        literal: How many words it names; wildcards do not count.
        complete: Whether it names every word that was said.
        captures: What the human said where the rule has "_".
    """

    rule: Rule
    literal: int
    complete: bool
    captures: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _State:
    """How a match got where it is: words named so far, and spans of its captures."""

    literal: int = 0
    captures: tuple[tuple[int, int, int], ...] = ()


_States = dict[int, _State]
"""Number of words consumed -> the best way to have done so."""


class Matcher:
    """Matches one utterance.

    Args:
        context: Variables, concepts and tags.
    """

    def __init__(self, utterance: Utterance, context: Context) -> None:
        self._said = utterance
        self._context = context
        self._topic = ""
        self._steps = 0

    def match(self, rule: Rule) -> Match | None:
        """Return how a rule matches; None if it does not."""
        if rule.input is None:
            return None
        self._topic, self._steps = rule.topic, 0
        count = len(self._said.words)
        exact = any(isinstance(node, Function) and node.name == "exact" for node in walk(rule.input))
        best: tuple[int, int, int] | None = None
        found: _State | None = None
        for start in range(1 if exact or not count else count):
            for end, state in self._step(rule.input, {start: _State()}, 0).items():
                if (exact and end != count) or (end == start) != (not count):
                    continue
                rank = (state.literal, end - start, -start)
                if best is None or rank > best:
                    best, found = rank, state
        if found is None:
            return None
        captures = {number: self._said.part(start, end) for number, start, end in found.captures}
        return Match(rule, found.literal, found.literal == count, captures)

    def _step(self, node: Node, states: _States, depth: int) -> _States:
        self._steps += 1
        if not states or self._steps > MAX_STEPS:
            return {}
        match node:
            case Sequence(items=items):
                for item in items:
                    states = self._step(item, states, depth)
                return states
            case Word(text=text):
                return self._words(words_of(text), states)
            case Choice(items=items):
                return self._any(items, states, depth)
            case Optional(items=items):
                return _merged(states, self._any(items, states, depth))
            case Repeat(items=items):
                return self._repeat(items, states, depth)
            case Concept(name=name):
                inside = self._context.concept(name) if depth < MAX_NESTING else None
                return {} if inside is None else self._step(inside, states, depth + 1)
            case Capture(number=number, item=item):
                return self._capture(number, item, states, depth)
            case Wildcard():
                return self._wildcard(states)
            case Forbidden(item=item):
                return {} if self._occurs(item, depth) else states
            case Event(name=name):
                return states if name in self._said.events else {}
            case Variable(name=name):
                value = self._context.variable(name)
                return {} if value is None else self._words(words_of(value), states)
            case Comparison() | Assignment():
                return states if self._holds(node) else {}
            case Tag(name=name):
                return states if self._context.tag_active(self._topic, name) else {}
            case Function(name=name):
                return self._function(node, states)

    def _words(self, words: tuple[str, ...], states: _States) -> _States:
        said, count = self._said.words, len(words)
        return {
            at + count: _State(state.literal + count, state.captures)
            for at, state in states.items()
            if said[at : at + count] == words
        }

    def _any(self, items: tuple[Node, ...], states: _States, depth: int) -> _States:
        found: _States = {}
        for item in items:
            found = _merged(found, self._step(item, states, depth))
        return found

    def _repeat(self, items: tuple[Node, ...], states: _States, depth: int) -> _States:
        found: _States = {}
        for _ in range(MAX_REPEATS):
            states = {at: state for at, state in self._any(items, states, depth).items() if at not in found}
            if not states:
                break
            found = _merged(found, states)
        return found

    def _capture(self, number: int, item: Node, states: _States, depth: int) -> _States:
        found: _States = {}
        for at, state in states.items():
            ends = self._step(item, {at: state}, depth)
            kept = {end: _State(after.literal, (*after.captures, (number, at, end))) for end, after in ends.items()}
            found = _merged(found, kept)
        return found

    def _wildcard(self, states: _States) -> _States:
        found: _States = {}
        for at, state in states.items():
            found = _merged(found, {end: state for end in range(at + 1, len(self._said.words) + 1)})
        return found

    def _occurs(self, item: Node, depth: int) -> bool:
        starts: _States = {at: _State() for at in range(len(self._said.words))}
        return bool(self._step(item, starts, depth))

    def _holds(self, node: Comparison | Assignment) -> bool:
        operator = node.operator if isinstance(node, Comparison) else "=="
        value = _plain(node.value, self._context)
        return value is not None and compare(self._context.variable(node.name), operator, value)

    def _function(self, node: Function, states: _States) -> _States:
        if node.name in ("exist", "notExist"):
            known = all(self._context.variable(name.lstrip("$")) is not None for name in node.texts)
            return states if known == (node.name == "exist") else {}
        return states


def compare(value: str | None, operator: str, other: str) -> bool:
    """Return whether a condition holds: as numbers if both are, else as text. One without a value never does."""
    if value is None:
        return False
    left: float | str
    right: float | str
    try:
        left, right = float(value), float(other)
    except ValueError:
        left, right = value.lower(), other.lower()
    if isinstance(left, float) and isinstance(right, float):
        order = (left > right) - (left < right)
    else:
        order = (str(left) > str(right)) - (str(left) < str(right))
    return {
        "==": order == 0,
        "<>": order != 0,
        "<": order < 0,
        ">": order > 0,
        "<=": order <= 0,
        ">=": order >= 0,
    }[operator]


def _plain(node: Node, context: Context) -> str | None:
    """Return a value in an input as text; None if it holds a variable that is not set."""
    if isinstance(node, Word):
        return node.text
    if isinstance(node, Variable):
        return context.variable(node.name)
    if isinstance(node, Sequence):
        parts = [_plain(item, context) for item in node.items]
        return None if None in parts else " ".join(part for part in parts if part is not None)
    return None


def _merged(first: _States, second: _States) -> _States:
    merged = dict(first)
    for at, state in second.items():
        if at not in merged or state.literal > merged[at].literal:
            merged[at] = state
    return merged
