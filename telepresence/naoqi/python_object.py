"""An object written in Python, served: its methods, Signals and Properties become members, as in the vendor's package.

A method's parameters come from `bind`, else they are dynamics, as many as it has positional ones (defaults do not make
any optional), or anything if it takes `*args`. Names that begin with two underscores and methods under `nobind` are
left out. Calls run one at a time unless the class is `multiThreaded`.
"""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable
from typing import Any

from .future import describe
from .proxy import Proxy
from .relay import Relay
from .served_object import ServedObject
from .signals import Property, Signal
from .signature import WireError
from .strands import strand_of

NOT_BOUND = "DONOTBIND"
_SERVED = "__qi_served__"
_lock = threading.Lock()


def served(value: Any) -> ServedObject:
    """Return what serves an object, the same each time.

    Raises:
        WireError: Its type has no form on the wire and cannot be served either.
    """
    if isinstance(value, ServedObject):
        return value
    if isinstance(value, Proxy):  # an object of somebody else: calls are passed on
        return Relay(value._remote, value._remote.uid)
    if not hasattr(value, "__dict__") or isinstance(value, type):
        raise WireError(f"a value of type {type(value).__name__} cannot be sent")
    with _lock:
        made = vars(value).get(_SERVED)
        if not isinstance(made, ServedObject):
            made = _make(value)
            try:
                setattr(value, _SERVED, made)
            except AttributeError as error:
                raise WireError(f"a value of type {type(value).__name__} cannot be sent: {error}") from None
        return made


def _make(value: Any) -> ServedObject:
    strand = strand_of(value)
    made = ServedObject("", parallel=strand is None, strand=strand)
    for name in dir(value):
        if name.startswith("__"):
            continue
        member = getattr(value, name, None)
        if isinstance(member, Signal):
            made.add_signal(name, member)
        elif isinstance(member, Property):
            made.add_property(name, member)
        elif callable(member):
            _add_method(made, name, member)
    if callable(value) and not isinstance(value, type) and inspect.isroutine(value):
        _add_method(made, "__call__", value)
    return made


def _add_method(made: ServedObject, name: str, function: Callable[..., Any]) -> None:
    parameters = getattr(function, "__qi_signature__", None) or parameters_of(function)
    if parameters == NOT_BOUND:
        return
    returns = getattr(function, "__qi_return_signature__", None) or "m"
    name = getattr(function, "__qi_name__", None) or name
    made.add_method(name, returns, parameters, _told(function), inspect.getdoc(function) or "")


def parameters_of(function: Callable[..., Any]) -> str:
    """Return the signature of the parameters of a function that nobody has declared, such as "(mm)"."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # written in C, without a signature
        return "m"
    if any(parameter.kind is parameter.VAR_POSITIONAL for parameter in parameters):
        return "m"
    positional = [one for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    return f"({'m' * len(positional)})"


def _told(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with errors whose text begins with their type, as callers of the vendor's servers see it."""

    def call(*args: Any) -> Any:
        try:
            return function(*args)
        except Exception as error:
            raise RuntimeError(describe(error)) from error

    return call
