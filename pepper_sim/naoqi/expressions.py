"""NAOqi's language of conditions, ('Launchpad/NumPeopleZone2' >= 1) ~ 3: parsed once, evaluated again and again.

Constants, lists, ALMemory keys in single quotes, operators and functions, in the documented order of precedence. What
has no value is Invalid, None here, and counts as 0. Operators of time, ~ @ #, and bang(), stable() and rand() remember
what they saw, so an expression has to be evaluated regularly. A service's signal or property, Service.Name, is always
Invalid. Source: NAOqi 2.8 documentation, conditions expression language.
"""

from __future__ import annotations

import operator
import random
import re
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from pepper_sim.naoqi.service import ServiceError, shown

LONGEST = 10_000
"""Characters of an expression."""
_DEEPEST = 50
_HISTORY = 100_000
_TOKEN = re.compile(
    r"""\s*(?:(?P<number>\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)|(?P<text>"[^"]*")|(?P<key>'[^']*')
    |(?P<word>[A-Za-z_][\w.]*)|(?P<sign>&&|\|\||==|!=|<=|>=|[-+*/%|&^<>!~@\#()\[\],]))""",
    re.VERBOSE,
)
_LEVELS = (("||",), ("&&",), ("==", "!="), ("<", "<=", ">", ">="), ("|", "&", "^"), ("+", "-"), ("*", "/", "%"))
"""Operators between two values, the loosest first; subsets and intersects and those of time bind tighter."""
_SETS = ("subsets", "intersects")
_TIMES = ("~", "@", "#")

Node = Callable[["Surroundings"], Any]


class Surroundings(Protocol):
    """What an expression is evaluated in."""

    @property
    def now(self) -> float:
        """Time [s], of any steady clock."""

    def key(self, name: str) -> Any:
        """Return the value of an ALMemory key; None if it has none."""

    def raised(self, name: str) -> int:
        """Return how often an event has been raised."""

    def preference(self, domain: str, name: str) -> str | None:
        """Return a preference; None if it is not set."""


def parse(text: str) -> Node:
    """Return the function that evaluates an expression.

    Raises:
        ServiceError: It is none; the text says where.
    """
    if len(text) > LONGEST:
        raise ServiceError(f"expression is longer than {LONGEST} characters")
    return _Parser(text).all()


def true(value: Any) -> bool:
    """Whether a value counts as true."""
    return bool(value)


class _Parser:
    def __init__(self, text: str) -> None:
        self._text, self._tokens, self._depth = text, _tokens(text), 0

    def all(self) -> Node:
        node = self._binary(0)
        if self._tokens:
            raise self._wrong(self._tokens[0][1])
        return node

    def _wrong(self, what: str) -> ServiceError:
        return ServiceError(f"expression {shown(self._text)} is none: {shown(what)} is out of place")

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
                node = _two(_OPERATORS[self._take()[1]], node, self._binary(level + 1))
        self._depth -= 1
        return node

    def _sets(self) -> Node:
        node = self._times()
        while self._peek() in _SETS:
            node = _two(_OPERATORS[self._take()[1]], node, self._times())
        return node

    def _times(self) -> Node:
        node = self._unary()
        while self._peek() in _TIMES:
            sign = self._take()[1]
            kind, number = self._take()
            if kind != "number":
                raise self._wrong(number)
            node = _TIME_OPERATORS[sign](node, float(number))
        return node

    def _unary(self) -> Node:
        if self._peek() in ("!", "-"):
            sign = self._take()[1]
            self._depth += 1
            if self._depth > _DEEPEST * (len(_LEVELS) + 1):
                raise ServiceError("the expression is nested too deeply")
            inner = self._unary()
            self._depth -= 1
            return (lambda around: not true(inner(around))) if sign == "!" else (lambda around: -_number(inner(around)))
        return self._indexed()

    def _indexed(self) -> Node:
        node = self._value()
        while self._peek() == "[":
            self._take()
            node = _two(_item, node, self._binary(0))
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
            return _Bang(key[1:-1])
        if name == "pref":
            domain = self._take()[1]
            self._expect(",")
            setting = self._take()[1]
            self._expect(")")
            return lambda around: around.preference(domain.strip('"'), setting.strip('"'))
        arguments = self._list(")")
        if name == "stable" and len(arguments) == 1:
            return _Stable(arguments[0])
        if name == "rand" and len(arguments) == 3:
            return _Random(*arguments)
        count, function = _FUNCTIONS.get(name, (-1, None))
        if function is None or count != len(arguments):
            raise self._wrong(name)
        return lambda around: function(*(argument(around) for argument in arguments))


def _tokens(text: str) -> deque[tuple[str, str]]:
    found: deque[tuple[str, str]] = deque()
    at = 0
    while text[at:].strip():
        match = _TOKEN.match(text, at)
        if match is None:
            raise ServiceError(f"expression {shown(text)} is none: {shown(text[at:].strip())} is unknown")
        found.append((str(match.lastgroup), match.group(str(match.lastgroup))))
        at = match.end()
    return found


class _For:
    """x ~ 3: x has been true for three seconds."""

    def __init__(self, node: Node, seconds: float) -> None:
        self._node, self._seconds, self._since = node, seconds, -1.0

    def __call__(self, around: Surroundings) -> bool:
        if not true(self._node(around)):
            self._since = -1.0
            return False
        if self._since < 0.0:
            self._since = around.now
        return around.now - self._since >= self._seconds


class _Ago:
    """x @ 10: x was true ten seconds ago."""

    def __init__(self, node: Node, seconds: float) -> None:
        self._node, self._seconds = node, seconds
        self._changes: deque[tuple[float, bool]] = deque(maxlen=_HISTORY)

    def __call__(self, around: Surroundings) -> bool:
        value = true(self._node(around))
        if not self._changes or self._changes[-1][1] != value:
            self._changes.append((around.now, value))
        then = around.now - self._seconds
        while len(self._changes) > 1 and self._changes[1][0] <= then:
            self._changes.popleft()
        return self._changes[0][1] and self._changes[0][0] <= then


class _Within:
    """x # 60: x was true at some time of the last minute."""

    def __init__(self, node: Node, seconds: float) -> None:
        self._node, self._seconds, self._last = node, seconds, float("-inf")

    def __call__(self, around: Surroundings) -> bool:
        if true(self._node(around)):
            self._last = around.now
        return around.now - self._last <= self._seconds


_TIME_OPERATORS: dict[str, Callable[[Node, float], Node]] = {"~": _For, "@": _Ago, "#": _Within}


class _Bang:
    """bang('key'): the event has just been raised."""

    def __init__(self, key: str) -> None:
        self._key, self._count = key, -1

    def __call__(self, around: Surroundings) -> bool:
        before, self._count = self._count, around.raised(self._key)
        return before not in (-1, self._count)


class _Stable:
    """stable(x): x has not just changed."""

    def __init__(self, node: Node) -> None:
        self._node, self._known, self._value = node, False, None

    def __call__(self, around: Surroundings) -> bool:
        before, self._value = self._value, self._node(around)
        known, self._known = self._known, True
        return not known or bool(before == self._value)


class _Random:
    """rand(low, high, period): a number that is another one every `period` seconds, or stays if that is 0."""

    def __init__(self, low: Node, high: Node, period: Node) -> None:
        self._low, self._high, self._period = low, high, period
        self._value: Any = None
        self._due = float("-inf")

    def __call__(self, around: Surroundings) -> Any:
        period = _number(self._period(around))
        if self._value is None or (period > 0 and around.now >= self._due):
            low, high = sorted((_number(self._low(around)), _number(self._high(around))))
            whole = isinstance(low, int) and isinstance(high, int)
            self._value = random.randint(int(low), int(high)) if whole else random.uniform(low, high)
            self._due = around.now + period
        return self._value


def _two(function: Callable[[Any, Any], Any], left: Node, right: Node) -> Node:
    def node(around: Surroundings) -> Any:  # both are evaluated each time: operators of time must see every moment
        values = left(around), right(around)
        return function(*values)

    return node


def _number(value: Any) -> Any:
    return value if isinstance(value, int | float) else 0


def _numbers(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def compute(left: Any, right: Any) -> Any:
        try:
            return function(_number(left), _number(right))
        except (ZeroDivisionError, OverflowError):
            return None

    return compute


def _integers(function: Callable[[int, int], int]) -> Callable[[Any, Any], int]:
    return lambda left, right: function(int(_number(left)), int(_number(right)))


def _ordered(function: Callable[[Any, Any], bool]) -> Callable[[Any, Any], bool]:
    def compare(left: Any, right: Any) -> bool:
        if isinstance(left, str) and isinstance(right, str):
            return function(left, right)
        if isinstance(left, str | list) or isinstance(right, str | list):
            return False
        return function(_number(left), _number(right))

    return compare


def _equal(left: Any, right: Any) -> bool:
    if left is None or right is None:
        return (left or 0) == (right or 0)
    return bool(left == right)


def _item(value: Any, index: Any) -> Any:
    if isinstance(value, list | tuple) and isinstance(index, int) and 0 <= index < len(value):
        return value[index]
    return None


def _as_list(value: Any) -> list:
    return list(value) if isinstance(value, list | tuple) else [value]


def _divide(left: Any, right: Any) -> Any:
    whole = isinstance(left, int) and isinstance(right, int)
    return int(left / right) if whole else left / right


def _cast(kind: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def cast(value: Any) -> Any:
        try:
            return kind(value if value is not None else 0)
        except (TypeError, ValueError, OverflowError):
            return None

    return cast


def _kind(value: Any) -> str:
    kinds = {bool: "Bool", int: "Int", float: "Float", str: "String", list: "Array", tuple: "Array"}
    return kinds.get(type(value), "Invalid")


_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "||": lambda left, right: true(left) or true(right),
    "&&": lambda left, right: true(left) and true(right),
    "==": _equal,
    "!=": lambda left, right: not _equal(left, right),
    "<": _ordered(operator.lt),
    "<=": _ordered(operator.le),
    ">": _ordered(operator.gt),
    ">=": _ordered(operator.ge),
    "|": _integers(operator.or_),
    "&": _integers(operator.and_),
    "^": _integers(operator.xor),
    "+": _numbers(operator.add),
    "-": _numbers(operator.sub),
    "*": _numbers(operator.mul),
    "/": _numbers(_divide),
    "%": _numbers(operator.mod),
    "subsets": lambda left, right: all(item in _as_list(right) for item in _as_list(left)),
    "intersects": lambda left, right: any(item in _as_list(right) for item in _as_list(left)),
}
_FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "substr": (3, lambda text, start, count: str(text)[int(start) : int(start) + int(count)]),
    "strlen": (1, lambda text: len(str(text))),
    "concat": (2, lambda left, right: f"{left}{right}"),
    "size": (1, lambda value: len(value) if isinstance(value, list | tuple | str) else 0),
    "type": (1, _kind),
    "int": (1, _cast(lambda value: int(float(value)))),
    "float": (1, _cast(float)),
    "string": (1, lambda value: "" if value is None else str(value)),
    "bool": (1, true),
}
