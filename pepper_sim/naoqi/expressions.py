"""NAOqi's language of conditions, ('Launchpad/NumPeopleZone2' >= 1) ~ 3: parsed once, evaluated again and again.

Constants, lists, ALMemory keys in single quotes, operators and functions, in the documented order of precedence. What
has no value is Invalid, None here, and counts as 0. Operators of time, ~ @ #, and bang(), stable() and rand() remember
what they saw, so an expression has to be evaluated regularly. A service's signal or property, Service.Name, is always
Invalid. Source: NAOqi 2.8 documentation, conditions expression language.
"""

from __future__ import annotations

import re
from collections import deque
from typing import Any

from pepper_sim.naoqi.expression_operators import (
    FUNCTIONS,
    OPERATORS,
    TIME_OPERATORS,
    Bang,
    Node,
    Random,
    Stable,
    item_of,
    number_of,
    true,
    two,
)
from pepper_sim.naoqi.service import ServiceError, shown

LONGEST = 10_000
"""Characters of an expression."""
_DEEPEST = 50
_TOKEN = re.compile(
    r"""\s*(?:(?P<number>\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)|(?P<text>"[^"]*")|(?P<key>'[^']*')
    |(?P<word>[A-Za-z_][\w.]*)|(?P<sign>&&|\|\||==|!=|<=|>=|[-+*/%|&^<>!~@\#()\[\],]))""",
    re.VERBOSE,
)
_LEVELS = (("||",), ("&&",), ("==", "!="), ("<", "<=", ">", ">="), ("|", "&", "^"), ("+", "-"), ("*", "/", "%"))
"""Operators between two values, the loosest first; subsets and intersects and those of time bind tighter."""
_SETS = ("subsets", "intersects")
_TIMES = ("~", "@", "#")


def parse(text: str) -> Node:
    """Return the function that evaluates an expression.

    Raises:
        ServiceError: It is none; the text says where.
    """
    if len(text) > LONGEST:
        raise ServiceError(f"expression is longer than {LONGEST} characters")
    return _Parser(text).all()


class _Parser:
    def __init__(self, text: str) -> None:
        self._text, self._tokens, self._depth = text, _tokens(text), 0

    def all(self) -> Node:
        node = self._binary(0)
        if self._tokens:
            raise self._wrong(self._tokens[0][1])
        return node

    def _wrong(self, what: str) -> ServiceError:
        return ServiceError(f"expression {shown(self._text)} is invalid: {shown(what)} is out of place")

    def _peek(self) -> str:
        kind, word = self._tokens[0] if self._tokens else ("", "")
        return word if kind in ("sign", "word") else ""

    def _take(self) -> tuple[str, str]:
        if not self._tokens:
            raise self._wrong("its end")
        return self._tokens.popleft()

    def _expect(self, sign: str) -> None:
        kind, word = self._take()
        if (kind, word) != ("sign", sign):
            raise self._wrong(word)

    def _binary(self, level: int) -> Node:
        self._depth += 1
        if self._depth > _DEEPEST * (len(_LEVELS) + 1):
            raise ServiceError("the expression is nested too deeply")
        if level == len(_LEVELS):
            node = self._sets()
        else:
            node = self._binary(level + 1)
            while self._peek() in _LEVELS[level]:
                node = two(OPERATORS[self._take()[1]], node, self._binary(level + 1))
        self._depth -= 1
        return node

    def _sets(self) -> Node:
        node = self._times()
        while self._peek() in _SETS:
            node = two(OPERATORS[self._take()[1]], node, self._times())
        return node

    def _times(self) -> Node:
        node = self._unary()
        while self._peek() in _TIMES:
            sign = self._take()[1]
            kind, number = self._take()
            if kind != "number":
                raise self._wrong(number)
            node = TIME_OPERATORS[sign](node, float(number))
        return node

    def _unary(self) -> Node:
        if self._peek() in ("!", "-"):
            sign = self._take()[1]
            self._depth += 1
            if self._depth > _DEEPEST * (len(_LEVELS) + 1):
                raise ServiceError("the expression is nested too deeply")
            inner = self._unary()
            self._depth -= 1
            return (
                (lambda around: not true(inner(around))) if sign == "!" else (lambda around: -number_of(inner(around)))
            )
        return self._indexed()

    def _indexed(self) -> Node:
        node = self._value()
        while self._peek() == "[":
            self._take()
            node = two(item_of, node, self._binary(0))
            self._expect("]")
        return node

    def _value(self) -> Node:
        kind, word = self._take()
        if kind == "number":
            number: int | float = int(word) if word.isdigit() else float(word)
            return lambda _: number
        if kind == "text":
            return lambda _: word[1:-1]
        if kind == "key":
            return lambda around: around.key(word[1:-1])
        if kind == "word":
            return self._function(word) if self._peek() == "(" else self._name(word)
        if word == "(":
            node = self._binary(0)
            self._expect(")")
            return node
        if word == "[":
            items = self._list("]")
            return lambda around: [item(around) for item in items]
        raise self._wrong(word)

    @staticmethod
    def _name(word: str) -> Node:
        """A signal, a property, or true, false and words of a list."""
        constant: Any = {"true": True, "false": False}.get(word, None if "." in word else word)
        return lambda _: constant

    def _list(self, closing: str) -> list[Node]:
        items: list[Node] = []
        while self._peek() != closing:
            if items:
                self._expect(",")
            items.append(self._binary(0))
        self._take()
        return items

    def _function(self, name: str) -> Node:
        self._expect("(")
        if name == "bang":
            kind, key = self._take()
            if kind != "key":
                raise self._wrong(key)
            self._expect(")")
            return Bang(key[1:-1])
        if name == "pref":
            domain = self._take()[1]
            self._expect(",")
            setting = self._take()[1]
            self._expect(")")
            return lambda around: around.preference(domain.strip('"'), setting.strip('"'))
        arguments = self._list(")")
        if name == "stable" and len(arguments) == 1:
            return Stable(arguments[0])
        if name == "rand" and len(arguments) == 3:
            return Random(*arguments)
        count, function = FUNCTIONS.get(name, (-1, None))
        if function is None or count != len(arguments):
            raise self._wrong(name)
        return lambda around: function(*(argument(around) for argument in arguments))


def _tokens(text: str) -> deque[tuple[str, str]]:
    found: deque[tuple[str, str]] = deque()
    at = 0
    while text[at:].strip():
        match = _TOKEN.match(text, at)
        if match is None:
            raise ServiceError(f"expression {shown(text)} is invalid: {shown(text[at:].strip())} is unknown")
        found.append((str(match.lastgroup), match.group(str(match.lastgroup))))
        at = match.end()
    return found
