"""Concepts: lists of words and phrases, static ones from topics and dynamic ones that programs fill."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from pepper_sim.dialog.nodes import Capture, Choice, Concept, Node, Optional, Repeat, Sequence, Topic, Word
from pepper_sim.dialog.reader import read_sentence

MAX_TEXTS = 5000
"""Most sentences that are made of one pattern."""


class Concepts:
    """The dynamic concepts, and where static ones are found."""

    def __init__(self) -> None:
        self._items: dict[tuple[str, str], list[str]] = {}
        self._read: dict[tuple[str, str], Sequence] = {}

    def fill(self, name: str, language: str, items: Iterable[str]) -> None:
        """Replace what a dynamic concept holds.

        Raises: TopicError: An item cannot be read.
        """
        kept = list(dict.fromkeys(items))
        content = Sequence((Choice(tuple(read_sentence(item) for item in kept), "next", -1),))
        self._items[language, name], self._read[language, name] = kept, content

    def add(self, name: str, language: str, items: Iterable[str]) -> None:
        """Put items before those that a dynamic concept holds."""
        self.fill(name, language, [*items, *self.content(name, language)])

    def discard(self, name: str, language: str, items: Iterable[str]) -> None:
        """Take items out of a dynamic concept."""
        gone = {item.lower() for item in items}
        self.fill(name, language, [item for item in self.content(name, language) if item.lower() not in gone])

    def content(self, name: str, language: str) -> list[str]:
        """List what a dynamic concept holds."""
        return list(self._items.get((language, name), []))

    def clear(self) -> None:
        """Empty all dynamic concepts."""
        self._items.clear()
        self._read.clear()

    def find(self, name: str, language: str, topics: Iterable[Topic]) -> Sequence | None:
        """Return a concept in a language: a dynamic one, or that of the first topic that defines it."""
        if (language, name) in self._read:
            return self._read[language, name]
        for topic in topics:
            if topic.language == language and name in topic.concepts:
                return topic.concepts[name]
        return None

    @staticmethod
    def texts(content: Node, find: Callable[[str], Sequence | None]) -> list[str]:
        """List everything that a pattern stands for, at most MAX_TEXTS sentences; a concept in itself is nothing."""
        return list(dict.fromkeys(_texts(content, find, {})))


def _texts(node: Node, find: Callable[[str], Sequence | None], known: dict[str, list[str]]) -> list[str]:
    """Return the texts of a node. `known` has the concepts that were listed already, or are being listed."""
    match node:
        case Word(text=text):
            return [text]
        case Sequence(items=items):
            found = [""]
            for item in items:
                found = list(_joined(found, _texts(item, find, known)))
            return found
        case Choice(items=items) | Repeat(items=items):
            return [text for item in items for text in _texts(item, find, known)][:MAX_TEXTS]
        case Optional(items=items):
            return [*(text for item in items for text in _texts(item, find, known)), ""][:MAX_TEXTS]
        case Concept(name=name):
            if name not in known:
                known[name] = []
                inside = find(name)
                known[name] = [] if inside is None else _texts(inside, find, known)
            return known[name]
        case Capture(item=item):
            return _texts(item, find, known)
    return [""]


def _joined(first: list[str], second: list[str]) -> Iterator[str]:
    count = 0
    for left in first:
        for right in second:
            if count >= MAX_TEXTS:
                return
            count += 1
            yield f"{left} {right}".strip()
