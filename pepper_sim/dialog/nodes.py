"""What a topic consists of: the nodes of inputs and outputs, its rules, and its concepts.

Source: NAOqi 2.8 documentation, "QiChat - Syntax". Inputs and outputs are made of the same nodes; `matching` reads them
as patterns, `answers` as sentences. `spaced` says whether white space stands before a node.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field


class TopicError(ValueError):
    """A topic that cannot be read; the text names line and column, both counted from 1."""

    def __init__(self, text: str, line: int, column: int) -> None:
        super().__init__(f"line {line}, column {column}: {text}")
        self.line, self.column = line, column


@dataclass(frozen=True)
class Word:
    text: str
    spaced: bool = True


@dataclass(frozen=True)
class Sequence:
    """Nodes one after the other; in quotes, or a whole input or output."""

    items: tuple[Node, ...] = ()
    spaced: bool = True


@dataclass(frozen=True)
class Choice:
    """[a b], one of the items. In an output `order` says which: "next" (in turn), "rand", "first", "firstOptional".

    A choice is known by its position in the text, so that two of the same words are taken in turn separately.
    """

    items: tuple[Node, ...]
    order: str
    position: int
    spaced: bool = True


@dataclass(frozen=True)
class Optional:
    """{a b}, one of the items or nothing."""

    items: tuple[Node, ...]
    position: int
    spaced: bool = True


@dataclass(frozen=True)
class Repeat:
    """^repeat[a b], one to ten of the items in any order."""

    items: tuple[Node, ...]


@dataclass(frozen=True)
class Concept:
    """~name"""

    name: str
    position: int
    spaced: bool = True


@dataclass(frozen=True)
class Capture:
    """_item, which the output calls $number."""

    number: int
    item: Node


@dataclass(frozen=True)
class Wildcard:
    """*, one word or more."""


@dataclass(frozen=True)
class Forbidden:
    """!item, which must not be said."""

    item: Node


@dataclass(frozen=True)
class Event:
    """e:name"""

    name: str


@dataclass(frozen=True)
class Variable:
    """$name"""

    name: str
    spaced: bool = True


@dataclass(frozen=True)
class Comparison:
    """$name==value; operators ==, <>, !=, <, >, <=, >="""

    name: str
    operator: str
    value: Node


@dataclass(frozen=True)
class Assignment:
    """$name=value"""

    name: str
    value: Node


@dataclass(frozen=True)
class Tag:
    """%name"""

    name: str


@dataclass(frozen=True)
class Function:
    """^name(arguments); `raw` is the text between the parentheses."""

    name: str
    arguments: tuple[Sequence, ...]
    raw: str
    spaced: bool = True

    @property
    def texts(self) -> list[str]:
        """The arguments as they are written, without quotes."""
        return [part.strip().strip('"') for part in self.raw.split(",")] if self.raw.strip() else []


Node = (
    Word
    | Sequence
    | Choice
    | Optional
    | Repeat
    | Concept
    | Capture
    | Wildcard
    | Forbidden
    | Event
    | Variable
    | Comparison
    | Assignment
    | Tag
    | Function
)


@dataclass(eq=False)
class Rule:
    """One rule with the rules of its scope. Two rules are the same only if they are one object.

    Attributes:
        kind: "u" user rule, "proposal", "c" result of a call, "e" failed call, "l" learning rule, "s" skin.
        level: 0, or 1 for u1:, 2 for u2: and so on.
        input: What the human says; None for proposals and "e".
        source: The input as it is written.
        properties: Names of the functions before its input, such as "private".
    """

    kind: str
    level: int
    input: Sequence | None
    output: Sequence
    source: str
    line: int
    properties: frozenset[str] = frozenset()
    scope: list[Rule] = field(default_factory=list)
    topic: str = ""

    def nodes(self) -> Iterator[Node]:
        """Return every node of the input and the output."""
        for part in (self.input, self.output):
            if part is not None:
                yield from walk(part)

    @property
    def output_tags(self) -> set[str]:
        return {node.name for node in walk(self.output) if isinstance(node, Tag)}


@dataclass(frozen=True)
class Definition:
    """def:name($a, $b) output"""

    parameters: tuple[str, ...]
    output: Sequence


@dataclass(eq=False)
class Topic:
    """One topic.

    Attributes:
        language: NAOqi's name, "English"; "" if the text names none.
        properties: "keepFocus", "noStay", "fallback" and so on.
        rules: Rules of level 0 in their order, proposals included.
        dynamics: Names of its dynamic concepts.
    """

    name: str
    language: str = ""
    description: str = ""
    overload: str = ""
    properties: frozenset[str] = frozenset()
    includes: list[str] = field(default_factory=list)
    rules: list[Rule] = field(default_factory=list)
    concepts: dict[str, Sequence] = field(default_factory=dict)
    dynamics: list[str] = field(default_factory=list)
    definitions: dict[str, Definition] = field(default_factory=dict)

    def all_rules(self) -> Iterator[Rule]:
        """Return every rule, those of scopes after the rule that opens them."""
        waiting = list(reversed(self.rules))
        while waiting:
            rule = waiting.pop()
            yield rule
            waiting.extend(reversed(rule.scope))

    @property
    def proposals(self) -> list[Rule]:
        return [rule for rule in self.rules if rule.kind == "proposal"]

    @property
    def events(self) -> set[str]:
        """Names of the events that its inputs wait for."""
        return {
            node.name
            for rule in self.all_rules()
            if rule.input is not None
            for node in walk(rule.input)
            if isinstance(node, Event)
        }


def walk(node: Node) -> Iterator[Node]:
    """Return a node and all nodes inside it."""
    waiting: list[Node] = [node]
    while waiting:
        found = waiting.pop()
        yield found
        for attribute in ("items", "arguments"):
            waiting.extend(reversed(getattr(found, attribute, ())))
        for attribute in ("item", "value"):
            inside = getattr(found, attribute, None)
            if inside is not None:
                waiting.append(inside)
