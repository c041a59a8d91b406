"""The types of NAOqi's messaging: "i" an int32, "[m]" a list of dynamics, "(ss)<Pair,first,second>" a named tuple.

    v nothing | b bool | c C w W i I l L integers of 8 to 64 bits, a capital is unsigned | f d float32, float64
    s string | r raw bytes | m dynamic | o object | [x] list | {kv} map | (xyz) tuple | +x optional | #x ~x arguments
    X unknown | _ none

Behind any of them may stand an annotation <...>. Source: libqi 4.0 (BSD-3-Clause), src/type/signature.cpp.
"""

from __future__ import annotations

from typing import NamedTuple

MAX_DEPTH = 32
"""Lists in lists, dynamics in dynamics ...: as many, in a signature and in a value."""
MAX_LENGTH = 16384
"""Characters of a signature. A metaobject's has 273."""
_CACHED_CHARACTERS = 32768
"""Characters of all signatures in a cache together: peers choose them, so it must not grow with what they choose."""

FLOATS = "fd"
NUMBER_FORMATS = dict(zip("cCwWiIlLfd", "bBhHiIqQfd"))
"""What the struct module calls them."""
_SIZES = {**dict(zip("bcCwWiIlLfd", (1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8))), "v": 0, "s": 4, "r": 4, "m": 4, "o": 8}
_CLOSING = {"[": "]", "(": ")", "{": "}"}


class WireError(RuntimeError):
    """What came over the wire is malformed, or a value has no form there. The text is one line."""


class Annotation(NamedTuple):
    """What stands in "<Name,field,field>"."""

    name: str
    fields: tuple[str, ...]


class Kind:
    """A type.

    code: Its first character.
    text, full: Its signature without and with annotations. Kinds with the same text are equal.
    children: Element, key and value, or members.
    annotation: Of this type itself, not of its children.
    depth: How many lists, maps, tuples stand in each other.
    width: How many types it consists of.
    min_size: Fewest bytes that a value takes.
    """

    __slots__ = ("annotation", "children", "code", "depth", "full", "min_size", "text", "width")

    def __init__(
        self, code: str, children: tuple[Kind, ...] = (), annotation: Annotation | None = None, full: str = ""
    ):
        self.code = code
        self.children = children
        self.annotation = annotation
        inside = "".join([child.text for child in children])
        self.text: str = code + inside + _CLOSING.get(code, "")
        self.full = full or self.text
        self.depth: int = 1 + max([child.depth for child in children], default=0) if children or code in _CLOSING else 0
        self.width: int = 1 + sum([child.width for child in children])
        self.min_size: int
        if code == "(":
            self.min_size = sum([child.min_size for child in children])
        else:
            self.min_size = _SIZES.get(code, 1 if code == "+" else 4)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Kind) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"Kind({self.full!r})"


_LEAVES = {code: Kind(code) for code in "vbcCwWiIlLfdsrmoX_"}


class SignatureCache(dict):
    """What was made of signatures, in bounded memory: it begins anew when it is full."""

    def __init__(self) -> None:
        super().__init__()
        self._characters = 0

    def keep(self, signature: str, made: object) -> None:
        """Keep it, unless the signature is unusually long."""
        if len(signature) > 1024:
            return
        self._characters += len(signature) + 16
        if self._characters > _CACHED_CHARACTERS:
            self.clear()
            self._characters = len(signature) + 16
        self[signature] = made


_PARSED = SignatureCache()
_SPLIT = SignatureCache()


def parse(text: str) -> Kind:
    """Return the one type that `text` is.

    Raises:
        WireError: It is none, several, too long or nested too deeply.
    """
    kind = _PARSED.get(text)
    if kind is None:
        kinds = _parse_all(text)
        if len(kinds) != 1:
            raise WireError(f"Invalid signature {shorten(text)}: {len(kinds)} types instead of one")
        kind = kinds[0]
        _PARSED.keep(text, kind)
    return kind


def split(text: str) -> tuple[str, ...]:
    """Split a signature into its types: "(ss[i])b" -> ("(ss[i])", "b"); annotations stay.

    Raises:
        WireError: As of `parse`.
    """
    types: tuple[str, ...] | None = _SPLIT.get(text)
    if types is None:
        types = tuple([kind.full for kind in _parse_all(text)])
        _SPLIT.keep(text, types)
    return types


def shorten(text: object, longest: int = 60) -> str:
    """Return what an error text shows of a peer's text: one line, not more than that many characters."""
    if isinstance(text, int) and text.bit_length() > 512:  # Python refuses to write out some thousand digits
        return f"an integer of {text.bit_length()} bits"
    shown = repr(text[: longest + 1] if isinstance(text, (str, bytes)) else text)
    return shown if len(shown) <= longest else shown[: longest - 3] + "..."


def _parse_all(text: str) -> list[Kind]:
    if not isinstance(text, str):
        raise WireError(f"Invalid signature {shorten(text)}")
    if len(text) > MAX_LENGTH:
        raise WireError(f"Invalid signature: {len(text)} characters, {MAX_LENGTH} are allowed")
    kinds, at = [], 0
    while at < len(text):
        kind, at = _take(text, at, 0)
        kinds.append(kind)
    return kinds


def _take(text: str, at: int, depth: int) -> tuple[Kind, int]:
    """Return the type that begins at `at`, and where it ends."""
    code, begin = text[at : at + 1], at
    at += 1
    if depth > MAX_DEPTH:
        raise WireError(f"Invalid signature {shorten(text)}: nested deeper than {MAX_DEPTH}")
    leaf = _LEAVES.get(code)
    children: tuple[Kind, ...] = ()
    if leaf is None:
        children, at = _take_children(text, at, code, depth + 1)
    if text[at : at + 1] != "<":
        if leaf is not None:
            return leaf, at
        return Kind(code, children, None, text[begin:at]), at
    annotation, at = _take_annotation(text, at)
    return Kind(code, children, annotation, text[begin:at]), at


def _take_children(text: str, at: int, code: str, depth: int) -> tuple[tuple[Kind, ...], int]:
    if code in ("+", "#", "~"):
        child, at = _take(text, at, depth)
        return (child,), at
    closing = _CLOSING.get(code)
    if closing is None:
        raise WireError(f"Invalid signature {shorten(text)}: {shorten(code) if code else 'its end'} is no type")
    children = []
    while text[at : at + 1] != closing:
        if at >= len(text):
            raise WireError(f"Invalid signature {shorten(text)}: {closing!r} is missing")
        child, at = _take(text, at, depth)
        children.append(child)
    if code != "(" and len(children) != (1 if code == "[" else 2):
        raise WireError(f"Invalid signature {shorten(text)}: {len(children)} types in {code}{closing}")
    return tuple(children), at + 1


def _take_annotation(text: str, at: int) -> tuple[Annotation, int]:
    level, begin, parts, part = 0, at, [], at + 1
    while at < len(text):
        char = text[at]
        if char == "<":
            level += 1
        elif char == ">":
            level -= 1
            if level == 0:
                parts.append(text[part:at])
                return Annotation(parts[0], tuple(parts[1:])), at + 1
        elif char == "," and level == 1:
            parts.append(text[part:at])
            part = at + 1
        at += 1
    raise WireError(f"Invalid signature {shorten(text[begin:])}: '>' is missing")


def convertibility(source: str, target: str) -> float:
    """Return how well values of one type convert to another: 1 perfectly, 0 not at all.

    Source: libqi 4.0, src/type/signature.cpp, isConvertibleTo.

    Raises:
        WireError: One of them is no signature.
    """
    return _score(parse(source), parse(target))


def _score(source: Kind, target: Kind) -> float:
    have, want = source.code, target.code
    if want == "v":
        return 1.0
    if want in "mX":
        return 0.95 if want == "m" else 0.9
    if want == "+":
        if have == "+":
            return _score(source.children[0], target.children[0])
        return 1.0 if have == "v" else _score(source, target.children[0])
    if have == want and not source.children and not target.children:
        return 1.0
    if have in "bcCwWiIlLfd" and want in "bcCwWiIlLfd":
        error = 0
        if have in FLOATS and want not in FLOATS:
            error += 3
        elif have not in FLOATS and want in FLOATS:
            error += 2
        return 1.0 - (error + (4 if want == "b" else 0)) / 100
    if have != want:
        return 0.0
    if len(source.children) != len(target.children):
        names = [kind.annotation.name if kind.annotation else "" for kind in (source, target)]
        return 0.1 if names[0] and names[0] == names[1] else 0.0
    score = 1.0
    for ours, theirs in zip(source.children, target.children):
        child = _score(ours, theirs)
        if child == 0.0:
            return 0.0
        score *= 1.0 - (1.0 - child) * 0.95
    return score
