"""Names for the types of the wire, for `bind`: Int32, List(String), Map(String, Float), Struct([Int32, String])."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


class _NamesSignature(type):
    """Makes a class such as Int32 usable as its own instance: both print as, and equal, their signature."""

    signature: str

    def __str__(cls) -> str:
        return cls.signature

    def __eq__(cls, other: object) -> bool:
        return signature_named(other) == cls.signature

    def __hash__(cls) -> int:
        return hash(cls.signature)


class TypeName(metaclass=_NamesSignature):
    """A type of the wire. signature: what it is called there."""

    signature = "X"

    def __str__(self) -> str:
        return self.signature

    def __eq__(self, other: object) -> bool:
        return signature_named(other) == self.signature

    def __hash__(self) -> int:
        return hash(self.signature)


Type = Any
"""A TypeName, a subclass of it, or a signature."""


def signature_named(type_: Any) -> str | None:
    """Return the signature of a type name or of a text, None for anything else."""
    if isinstance(type_, str):
        return type_
    named = isinstance(type_, TypeName) or (isinstance(type_, type) and issubclass(type_, TypeName))
    return type_.signature if named else None


def _simple(name: str, signature: str, doc: str) -> Any:
    return _NamesSignature(name, (TypeName,), {"signature": signature, "__doc__": doc, "__module__": __name__})


Void = _simple("Void", "v", "Nothing.")
Bool = _simple("Bool", "b", "True or False.")
Int8 = _simple("Int8", "c", "Signed integer of 8 bits.")
UInt8 = _simple("UInt8", "C", "Unsigned integer of 8 bits.")
Int16 = _simple("Int16", "w", "Signed integer of 16 bits.")
UInt16 = _simple("UInt16", "W", "Unsigned integer of 16 bits.")
Int32 = _simple("Int32", "i", "Signed integer of 32 bits.")
UInt32 = _simple("UInt32", "I", "Unsigned integer of 32 bits.")
Int64 = _simple("Int64", "l", "Signed integer of 64 bits.")
UInt64 = _simple("UInt64", "L", "Unsigned integer of 64 bits.")
Float = _simple("Float", "f", "Floating point number of 32 bits.")
Double = _simple("Double", "d", "Floating point number of 64 bits.")
String = _simple("String", "s", "Text.")
Buffer = _simple("Buffer", "r", "Raw bytes.")
Raw = Buffer
Dynamic = _simple("Dynamic", "m", "A value of any type, which travels with it.")
Object = _simple("Object", "o", "An object, passed by reference.")
AnyArguments = _simple("AnyArguments", "m", "As the only parameter type of a method: it takes any arguments.")


class List(TypeName):
    """A list of one type."""

    def __init__(self, elementType: Type) -> None:
        self.signature = f"[{_signature(elementType)}]"


class Optional(TypeName):
    """A value of a type, or None."""

    def __init__(self, valueType: Type) -> None:
        self.signature = f"+{_signature(valueType)}"


class Map(TypeName):
    """A dict with keys of one type and values of one type."""

    def __init__(self, keyType: Type, elementType: Type) -> None:
        self.signature = f"{{{_signature(keyType)}{_signature(elementType)}}}"


class Struct(TypeName):
    """A tuple of given types. (The vendor's raises an AttributeError for every list.)"""

    def __init__(self, fields: Sequence[Type]) -> None:
        self.signature = f"({''.join(_signature(one) for one in fields)})"


def _signature(type_: Type) -> str:
    signature = signature_named(type_)
    if signature is None:
        raise TypeError(f"{type_!r} is no type of the wire")
    return signature


def typeof(value: Any) -> Any:
    """Return `Object` for a proxy. NotImplementedError for anything else, as in the vendor's package."""
    from .proxy import Proxy

    if isinstance(value, Proxy):
        return Object
    raise NotImplementedError("typeof knows objects only")


def is_instance(value: Any, type_: Any) -> bool:
    """Whether a value is an `Object`; the package calls this `isinstance`. NotImplementedError for other types."""
    from .proxy import Proxy

    if signature_named(type_) != "o":
        raise NotImplementedError("isinstance knows Object only")
    return isinstance(value, Proxy)
