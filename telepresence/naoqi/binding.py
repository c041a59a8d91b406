"""Decorators that say how an object's methods are offered: types, names, and whether calls run side by side."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from .python_object import NOT_BOUND
from .type_names import signature_named

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Class = TypeVar("_Class", bound=type)


class bind:
    """Declare a method: `@bind(Int32, (Int32, String), "add")`.

    Args:
        returnType: Of the result; None: any.
        paramsType: A tuple or list of types, one for each parameter, or AnyArguments; None: any, by the method's own
            parameters.
        methodName: What others call it; None: its own name.
    """

    def __init__(self, returnType: Any = None, paramsType: Any = None, methodName: str | None = None) -> None:
        self._returns = None if returnType is None else str(returnType)
        if paramsType is None:
            self._parameters = None
        elif isinstance(paramsType, (list, tuple)):
            self._parameters = f"({''.join(str(one) for one in paramsType)})"
        elif signature_named(paramsType) == "m":
            self._parameters = "m"
        else:
            raise Exception("Invalid types for parameters")  # the vendor's class and text
        self._name = methodName

    def __call__(self, f: _Function) -> _Function:
        for name, value in (("name", self._name), ("signature", self._parameters), ("return_signature", self._returns)):
            setattr(f, f"__qi_{name}__", value)
        return f


def nobind(func: _Function) -> _Function:
    """Do not offer this method to others."""
    setattr(func, "__qi_signature__", NOT_BOUND)  # noqa: B010  # an attribute that functions do not declare
    return func


class _Threading:
    _kind = "single"

    def __call__(self, f: _Class) -> _Class:
        setattr(f, "__qi_threading__", self._kind)  # noqa: B010  # an attribute that classes do not declare
        return f


class singleThreaded(_Threading):
    """Class decorator: calls and callbacks of one instance run one at a time. That is the default."""


class multiThreaded(_Threading):
    """Class decorator: calls of one instance run side by side; the class sees to its own locks."""

    _kind = "multi"
