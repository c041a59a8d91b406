"""What an object offers: methods, signals and properties by number, and which overload a call means.

Source: libqi 4.0 (BSD-3-Clause), src/registration.cpp, src/type/metaobject.cpp, src/messaging/boundobject.cpp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from .dynamics import PYTHON, Dialect, Typed, signature_of
from .signature import WireError, convertibility, parse

METAOBJECT = (
    "({I(Issss[(ss)<MetaMethodParameter,name,description>]s)"
    "<MetaMethod,uid,returnSignature,name,parametersSignature,description,parameters,returnDescription>}"
    "{I(Iss)<MetaSignal,uid,name,signature>}{I(Iss)<MetaProperty,uid,name,signature>}s)"
    "<MetaObject,methods,signals,properties,description>"
)
FIRST_OWN_ID = 100
"""Members of an object of one's own are numbered from here."""


class MetaMethod(NamedTuple):
    """A method. parameters: a tuple such as "(is)", or "m": anything; arguments: name and description of each."""

    uid: int
    returns: str
    name: str
    parameters: str
    description: str = ""
    arguments: tuple[tuple[str, str], ...] = ()
    returns_description: str = ""


class MetaSignal(NamedTuple):
    """A signal. signature: of what it emits, a tuple such as "(is)", or "m": one dynamic that holds the tuple."""

    uid: int
    name: str
    signature: str


class MetaProperty(NamedTuple):
    """A property; it has a signal of the same number. signature: of its value, such as "i"."""

    uid: int
    name: str
    signature: str


@dataclass
class MetaObject:
    """The members of an object, by number."""

    methods: dict[int, MetaMethod] = field(default_factory=dict)
    signals: dict[int, MetaSignal] = field(default_factory=dict)
    properties: dict[int, MetaProperty] = field(default_factory=dict)
    description: str = ""

    def to_value(self) -> tuple:
        """Return it as a value of the type METAOBJECT."""
        methods = {
            uid: (uid, method.returns, method.name, method.parameters, method.description, method.arguments, method[6])
            for uid, method in self.methods.items()
        }
        return methods, dict(self.signals), dict(self.properties), self.description

    @classmethod
    def from_value(cls, value: Any) -> MetaObject:
        """Return the one that a value of the type METAOBJECT describes.

        Raises:
            WireError: It is no such value.
        """
        try:
            methods, signals, properties, description = _members(value)
            return cls(
                {uid: _method(uid, _members(item)) for uid, item in methods.items()},
                {uid: MetaSignal(uid, *map(_text, _members(item)[1:3])) for uid, item in signals.items()},
                {uid: MetaProperty(uid, *map(_text, _members(item)[1:3])) for uid, item in properties.items()},
                _text(description),
            )
        except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
            raise WireError(f"no description of an object: {type(error).__name__}") from None

    def methods_named(self, name: str) -> list[MetaMethod]:
        """Return the overloads of a name, in the order of their numbers."""
        return [method for _, method in sorted(self.methods.items()) if method.name == name]

    def signal(self, name: str) -> MetaSignal | None:
        """Return a signal by its name."""
        return next((signal for signal in self.signals.values() if signal.name == name), None)

    def property(self, name: str) -> MetaProperty | None:
        """Return a property by its name."""
        return next((item for item in self.properties.values() if item.name == name), None)


def _members(value: Any) -> Sequence[Any]:
    return tuple(value.values()) if isinstance(value, dict) else tuple(value)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, (bytes, bytearray)) else str(value)


def _method(uid: int, members: Sequence[Any]) -> MetaMethod:
    _, returns, name, parameters, description, arguments, returns_description = members
    named = tuple([(_text(one), _text(other)) for one, other in map(_members, arguments)])
    texts = [_text(text) for text in (returns, name, parameters, description)]
    return MetaMethod(uid, texts[0], texts[1], texts[2], texts[3], named, _text(returns_description))


BUILT_IN = {
    method.uid: method
    for method in (
        MetaMethod(0, "L", "registerEvent", "(IIL)"),
        MetaMethod(1, "v", "unregisterEvent", "(IIL)"),
        MetaMethod(2, METAOBJECT, "metaObject", "(I)"),
        MetaMethod(3, "v", "terminate", "(I)"),
        MetaMethod(5, "m", "property", "(m)"),
        MetaMethod(6, "v", "setProperty", "(mm)"),
        MetaMethod(7, "[s]", "properties", "()"),
        MetaMethod(8, "L", "registerEventWithSignature", "(IILs)"),
    )
}
"""The methods of every object, by number."""


class NoSuchMethod(RuntimeError, AttributeError):
    """An object has no method of that name: libqi's proxies raise the one error or the other, by how it is called."""


def choose_overload(meta: MetaObject, name: str, arguments: Sequence[Any], dialect: Dialect = PYTHON) -> MetaMethod:
    """Return the method that a call means; for True it is one that takes a bool, where libqi cannot decide.

    Args:
        name: "say", or with its types "say::(s)".

    Raises:
        NoSuchMethod: There is no method of that name.
        RuntimeError: None takes these arguments, or several take them equally well; the lines after the first list
            the overloads.
    """
    plain_name, separator, _ = name.partition("::")
    overloads = meta.methods_named(plain_name)
    if len(overloads) == 1 and not separator and _takes(overloads[0], len(arguments)):
        return overloads[0]
    resolved = f"({''.join([signature_of(argument, dialect, resolve=True) for argument in arguments])})"
    exact = [method for method in overloads if separator and name in _full_names(method)]
    if exact:
        return exact[0]
    if separator or not overloads:
        raise NoSuchMethod(_refusal("Can't find method:", name, resolved, overloads))
    fitting = [method for method in overloads if _takes(method, len(arguments))]
    if len(fitting) == 1:
        return fitting[0]
    static = [argument.signature if isinstance(argument, Typed) else "m" for argument in arguments]
    for signature in (f"({''.join(static)})", resolved):
        scores = [(convertibility(signature, method.parameters), method) for method in fitting]
        best = max([score for score, _ in scores], default=0.0)
        if best > 0.0:
            chosen = [method for score, method in scores if score == best]
            if len(chosen) > 1:
                raise RuntimeError(_refusal("Ambiguous overload for", name, resolved, fitting))
            return chosen[0]
    raise RuntimeError(_refusal("Arguments types did not match for", name, resolved, overloads))


def _full_names(method: MetaMethod) -> tuple[str, str]:
    return f"{method.name}::{method.parameters}", f"{method.name}::{method.returns}{method.parameters}"


def _takes(method: MetaMethod, count: int) -> bool:
    if method.parameters == "m":
        return True
    try:
        kind = parse(method.parameters)
    except WireError:  # a robot's method with a signature that nobody can read is none of the candidates
        return False
    return kind.code == "(" and len(kind.children) == count


def _refusal(what: str, name: str, resolved: str, candidates: Sequence[MetaMethod]) -> str:
    text = f"{what} {name} (resolved to '{resolved}')"
    if not candidates:
        return text
    listed = [f"  {method.name}::{method.parameters}" for method in candidates]
    return "\n".join([f"{text}:", "  Candidates:" if len(listed) > 1 else "  Candidate:", *listed])
