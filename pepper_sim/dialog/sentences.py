"""Reads the sentences of a topic: inputs, outputs, and the contents of concepts."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable

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
    Sequence,
    Tag,
    TopicError,
    Variable,
    Wildcard,
    Word,
)

MAX_DEPTH = 40
"""Brackets inside brackets."""
ORDERS = ("rand", "first", "firstOptional")

_NAME = re.compile(r"[\w-]*\w")
_VARIABLE = re.compile(r"\w+(?:/\w+)*")
_EVENT = re.compile(r"\w+(?:[/.]\w+)*")
_OPERATOR = re.compile(r"\s*(==|<>|!=|<=|>=|<|>|=)\s*")
_FUNCTION = re.compile(r"\w+")
_CLOSING = {"[": "]", "{": "}", '"': '"', "(": ")"}


class SentenceReader:
    """Reads `text` from `start` to `end`.

    Args:
        error: Makes the error of a problem at a position.
        kind: "input", "output" or "concept"; wildcards, captures, forbidden words and events are for inputs.
    Attributes:
        at: Position of the next character.
    """

    def __init__(
        self, text: str, start: int, end: int, error: Callable[[str, int], TopicError], kind: str, depth: int = 0
    ) -> None:
        self._text = text
        self.at = start
        self._end = end
        self._error = error
        self._kind = kind
        self._captures = 0
        self._depth = depth

    def all(self) -> Sequence:
        """Read to the end.

        Raises: TopicError: A bracket is missing or superfluous, or a name is.
        """
        items = self._items("")
        return Sequence(tuple(items))

    def properties(self) -> frozenset[str]:
        """Read the functions before an input's parenthesis, "^private"."""
        names = set()
        while self._skip() and self._text[self.at] == "^":
            self.at += 1
            names.add(self._match(_FUNCTION, "a function's name is missing after '^'"))
        return frozenset(names)

    def in_parentheses(self) -> tuple[str, Sequence]:
        """Read an input with its parentheses; return it as written, and read."""
        if not self._skip() or self._text[self.at] != "(":
            raise self._error("an input must be written in parentheses, '(words)'", self.at)
        start = self.at
        items = self._bracket("(")
        return self._text[start + 1 : self.at - 1].strip(), Sequence(tuple(items))

    # --- inside ------------------------------------------------------------------------------------------------------

    def _bracket(self, opening: str) -> list[Node]:
        """Read from an opening bracket to its closing one, both included."""
        start, closing = self.at, _CLOSING[opening]
        if self._depth >= MAX_DEPTH:
            raise self._error(f"more than {MAX_DEPTH} brackets are nested", start)
        self.at += 1
        self._depth += 1
        items = self._items(closing)
        self._depth -= 1
        if self.at >= self._end:
            raise self._error(f"'{closing}' is missing for this '{opening}'", start)
        self.at += 1
        return items

    def _items(self, closing: str) -> list[Node]:
        """Read nodes up to `closing`, which is left, or to the end."""
        items: list[Node] = []
        while True:
            before = self.at
            if not self._skip() or (closing and self._text[self.at] == closing):
                return items
            node = self._node(self.at > before or not items, closing)
            if node != Sequence((), spaced=True) and node != Sequence((), spaced=False):
                items.append(node)

    def _skip(self) -> bool:
        """Skip white space; whether anything is left."""
        while self.at < self._end and self._text[self.at].isspace():
            self.at += 1
        return self.at < self._end

    def _node(self, spaced: bool, closing: str) -> Node:
        character, start = self._text[self.at], self.at
        if character == "[":
            return Choice(tuple(self._bracket("[")), "next", start, spaced)
        if character == "{":
            return Optional(tuple(self._bracket("{")), start, spaced)
        if character == '"':
            return Sequence(tuple(self._bracket('"')), spaced)
        if character in "]}" or (character == ")" and self._kind == "input"):
            missing = (
                f"'{closing}' is missing before this '{character}'" if closing else f"'{character}' closes nothing"
            )
            raise self._error(missing, start)
        if character == "(" and self._kind == "input":
            return Sequence(tuple(self._bracket("(")), spaced)
        if character == "~":
            self.at += 1
            return Concept(self._match(_NAME, "a concept's name is missing after '~'"), start, spaced)
        if character == "$":
            return self._variable(spaced, closing)
        if character == "^":
            return self._function(spaced)
        if character == "%" and _NAME.match(self._text, self.at + 1, self._end):
            self.at += 1
            name = self._match(_NAME, "")
            if name == "script":
                raise self._error("programs inside topics, %script, are not supported", start)
            return Tag(name)
        return self._input_node(spaced, closing) if self._kind != "output" else self._word(spaced)

    def _input_node(self, spaced: bool, closing: str) -> Node:
        character, start = self._text[self.at], self.at
        if character == "*":
            self.at += 1
            return Wildcard()
        if character in "_!":
            self.at += 1
            if character == "_":
                self._captures += 1
            number = self._captures
            if self.at >= self._end or self._text[self.at].isspace() or self._text[self.at] in ')]}"':
                raise self._error(f"'{character}' needs a word or a choice behind it", start)
            item = self._deeper(lambda: self._node(True, closing), start)
            return Capture(number, item) if character == "_" else Forbidden(item)
        if self._text.startswith("e:", self.at) and _EVENT.match(self._text, self.at + 2, self._end):
            self.at += 2
            return Event(self._match(_EVENT, ""))
        return self._word(spaced)

    def _deeper(self, read: Callable[[], Node], start: int) -> Node:
        if self._depth >= MAX_DEPTH:
            raise self._error(f"more than {MAX_DEPTH} brackets are nested", start)
        self._depth += 1
        node = read()
        self._depth -= 1
        return node

    def _word(self, spaced: bool) -> Word:
        start, ends = self.at, '[]{}"~$^' + ("()" if self._kind == "input" else "")
        self.at += 1
        while self.at < self._end and self._text[self.at] not in ends and not self._text[self.at].isspace():
            self.at += 1
        return Word(self._text[start : self.at], spaced)

    def _variable(self, spaced: bool, closing: str) -> Node:
        self.at += 1
        name = self._match(_VARIABLE, "a variable's name is missing after '$'")
        operator = _OPERATOR.match(self._text, self.at, self._end)
        if operator is None:
            return Variable(name, spaced)
        start = self.at
        self.at = operator.end()
        if self.at >= self._end or (closing and self._text[self.at] == closing):
            raise self._error(f"a value is missing behind '{operator.group(1)}'", start)
        value = self._deeper(lambda: self._value(closing), start)
        if operator.group(1) == "=" and self._kind == "output":
            return Assignment(name, value)
        return Comparison(name, operator.group(1).replace("!=", "<>") if operator.group(1) != "=" else "==", value)

    def _value(self, closing: str) -> Node:
        node = self._node(False, closing)
        if isinstance(node, Comparison | Assignment):
            raise self._error("a value must be a word, a variable or words in quotes", self.at)
        return node

    def _function(self, spaced: bool) -> Node:
        start = self.at
        self.at += 1
        name = self._match(_FUNCTION, "a function's name is missing after '^'")
        if name in ORDERS or name == "repeat":
            after = self.at
            if self._skip() and self._text[self.at] == "[":
                items = tuple(self._bracket("["))
                return Repeat(items) if name == "repeat" else Choice(items, name, start, spaced)
            self.at = after
        if self.at < self._end and self._text[self.at] == "(":
            return self._call(name, spaced)
        return Function(name, (), "", spaced)

    def _call(self, name: str, spaced: bool) -> Function:
        """Read a function's arguments, the parenthesis being the next character."""
        opening, depth, quoted, cuts = self.at, 0, False, []
        while self.at < self._end:
            character = self._text[self.at]
            if character == '"':
                quoted = not quoted
            elif not quoted and character in "([{":
                depth += 1
            elif not quoted and character in ")]}":
                depth -= 1
                if depth == 0:
                    break
            elif not quoted and character == "," and depth == 1:
                cuts.append(self.at)
            self.at += 1
        else:
            raise self._error("')' is missing for this '('", opening)
        edges = [opening, *cuts, self.at]
        raw = self._text[opening + 1 : self.at]
        self.at += 1
        if self._depth >= MAX_DEPTH:
            raise self._error(f"more than {MAX_DEPTH} brackets are nested", opening)
        arguments = tuple(
            SentenceReader(self._text, left + 1, right, self._error, "output", self._depth + 1).all()
            for left, right in itertools.pairwise(edges)
            if self._text[left + 1 : right].strip()
        )
        return Function(name, arguments, raw, spaced)

    def _match(self, pattern: re.Pattern[str], missing: str) -> str:
        found = pattern.match(self._text, self.at, self._end)
        if found is None:
            raise self._error(missing, self.at - 1)
        self.at = found.end()
        return found.group()
