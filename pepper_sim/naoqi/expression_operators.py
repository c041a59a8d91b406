"""What NAOqi's conditions compute: operators, functions, and what remembers. See `pepper_sim.naoqi.expressions`."""

from __future__ import annotations

import operator
import random
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

_HISTORY = 100_000

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


def true(value: Any) -> bool:
    """Whether a value counts as true."""
    return bool(value)


class For:
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


class Ago:
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


class Within:
    """x # 60: x was true at some time of the last minute."""

    def __init__(self, node: Node, seconds: float) -> None:
        self._node, self._seconds, self._last = node, seconds, float("-inf")

    def __call__(self, around: Surroundings) -> bool:
        if true(self._node(around)):
            self._last = around.now
        return around.now - self._last <= self._seconds


TIME_OPERATORS: dict[str, Callable[[Node, float], Node]] = {"~": For, "@": Ago, "#": Within}


class Bang:
    """bang('key'): the event has just been raised."""

    def __init__(self, key: str) -> None:
        self._key, self._count = key, -1

    def __call__(self, around: Surroundings) -> bool:
        before, self._count = self._count, around.raised(self._key)
        return before not in (-1, self._count)


class Stable:
    """stable(x): x has not just changed."""

    def __init__(self, node: Node) -> None:
        self._node, self._known, self._value = node, False, None

    def __call__(self, around: Surroundings) -> bool:
        before, self._value = self._value, self._node(around)
        known, self._known = self._known, True
        return not known or bool(before == self._value)


class Random:
    """rand(low, high, period): a number that is another one every `period` seconds, or stays if that is 0."""

    def __init__(self, low: Node, high: Node, period: Node) -> None:
        self._low, self._high, self._period = low, high, period
        self._value: Any = None
        self._due = float("-inf")

    def __call__(self, around: Surroundings) -> Any:
        period = number_of(self._period(around))
        if self._value is None or (period > 0 and around.now >= self._due):
            low, high = sorted((number_of(self._low(around)), number_of(self._high(around))))
            whole = isinstance(low, int) and isinstance(high, int)
            self._value = random.randint(int(low), int(high)) if whole else random.uniform(low, high)
            self._due = around.now + period
        return self._value


def two(function: Callable[[Any, Any], Any], left: Node, right: Node) -> Node:
    def node(around: Surroundings) -> Any:  # both are evaluated each time: operators of time must see every moment
        values = left(around), right(around)
        return function(*values)

    return node


def number_of(value: Any) -> Any:
    return value if isinstance(value, int | float) else 0


def _numbers(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def compute(left: Any, right: Any) -> Any:
        try:
            return function(number_of(left), number_of(right))
        except (ZeroDivisionError, OverflowError):
            return None

    return compute


def _integers(function: Callable[[int, int], int]) -> Callable[[Any, Any], int]:
    return lambda left, right: function(int(number_of(left)), int(number_of(right)))


def _ordered(function: Callable[[Any, Any], bool]) -> Callable[[Any, Any], bool]:
    def compare(left: Any, right: Any) -> bool:
        if isinstance(left, str) and isinstance(right, str):
            return function(left, right)
        if isinstance(left, str | list) or isinstance(right, str | list):
            return False
        return function(number_of(left), number_of(right))

    return compare


def _equal(left: Any, right: Any) -> bool:
    if left is None or right is None:
        return (left or 0) == (right or 0)
    return bool(left == right)


def item_of(value: Any, index: Any) -> Any:
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


OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
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
FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
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
