"""A proxy: an object at the other end that looks like one of this program; the interface is the vendor's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .future import Future, failed
from .metaobject import FIRST_OWN_ID, METAOBJECT, MetaObject, choose_overload
from .remote_object import RemoteObject, arity
from .remote_signal import RemoteProperty, RemoteSignal


class RemoteMethod:
    """A method of a proxy, all overloads of its name. With `_async=True` a call returns a Future at once."""

    def __init__(self, remote: RemoteObject, name: str) -> None:
        self._remote = remote
        self._name = name
        overloads = remote.meta.methods_named(name)
        self._single = overloads[0] if len(overloads) == 1 else None
        self._arity = arity(self._single.parameters) if self._single is not None else -1
        self.__name__ = name
        self.__doc__ = "\n".join(
            f"{method.name}::{method.parameters} -> {method.returns}\n{method.description}" for method in overloads
        )

    def __repr__(self) -> str:
        return f"<method {self._name} of {self._remote.service}.{self._remote.object}>"

    def start(self, args: Sequence[Any]) -> Future:
        """Send the call. RuntimeError: no overload takes these arguments, or they have no form on the wire."""
        method = self._single
        if method is None or self._arity not in (-1, len(args)):
            method = choose_overload(self._remote.meta, self._name, args, self._remote.connection.dialect)
        return self._remote.call(method, args)

    def __call__(self, *args: Any, _async: bool = False, **keywords: Any) -> Any:
        if keywords:
            return _refused(f"{self._name}: the wire has no names of arguments: {', '.join(keywords)}", _async)
        if not _async:
            return self.start(args).value()
        try:
            return self.start(args)
        except RuntimeError as error:
            return failed(error)


def _refused(text: str, _async: bool) -> Future:
    if _async:
        return failed(text)
    raise RuntimeError(text)


class Proxy:
    """An object of a service, which `remote` stands for: its methods, signals and properties are attributes."""

    def __init__(self, remote: RemoteObject) -> None:
        self._remote = remote
        if remote.meta.methods_named("post"):  # a member of that name is what the caller means
            self.__dict__["post"] = RemoteMethod(remote, "post")

    def __getattr__(self, name: str) -> Any:
        # Called once for each name: what is found becomes an attribute. The members hold the remote object, not this
        # proxy, so that there is no cycle to keep a passed object alive.
        if not name.startswith("__") and "_remote" in self.__dict__:
            member = _member(self._remote, name)
            if member is not None:
                self.__dict__[name] = member
                return member
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        meta = self._remote.meta
        names = {method.name for uid, method in meta.methods.items() if uid >= FIRST_OWN_ID}
        names |= {signal.name for uid, signal in meta.signals.items() if uid >= FIRST_OWN_ID}
        return sorted({*super().__dir__(), *names})

    def __repr__(self) -> str:
        return f"<Proxy of object {self._remote.service}.{self._remote.object}>"

    def call(self, name: str, *args: Any, _async: bool = False) -> Any:
        """Call a method by its name, built-in ones too; "say::(s)" chooses an overload."""
        try:
            method = choose_overload(self._remote.meta, name, args, self._remote.connection.dialect)
            result = self._remote.call(method, args)
        except RuntimeError as error:
            if _async:
                return failed(error)
            raise
        return result if _async else result.value()

    def async_(self, name: str, *args: Any) -> Future:
        """Call a method by its name and return the future of its result. The vendor's package calls this `async`."""
        return self.call(name, *args, _async=True)

    def post(self, name: str, *args: Any) -> None:
        """Call a method without waiting for anything: no result and no error comes back."""
        method = choose_overload(self._remote.meta, name, args, self._remote.connection.dialect)
        self._remote.post(method.uid, method.parameters, args)

    def metaObject(self) -> dict[str, Any]:
        """Return the members as the vendor's package does: methods, signals, properties by number, description."""
        return members_of(self._remote.meta)

    def isValid(self) -> bool:
        """Whether this stands for an object: always. Calls tell whether it can still be reached."""
        return True


setattr(Proxy, "async", Proxy.async_)


def remote_of(proxy: Proxy) -> RemoteObject:
    """Return what a proxy stands for."""
    return proxy._remote


def _member(remote: RemoteObject, name: str) -> Any:
    meta = remote.meta
    prop = meta.property(name)
    if prop is not None:
        return RemoteProperty(remote, prop.uid, name, prop.signature)
    signal = meta.signal(name)
    if signal is not None and signal.uid >= FIRST_OWN_ID:
        return RemoteSignal(remote, signal.uid, name, signal.signature)
    if any(method.uid >= FIRST_OWN_ID for method in meta.methods_named(name)):
        return RemoteMethod(remote, name)
    return None


def members_of(meta: MetaObject) -> dict[str, Any]:
    """Return a metaobject as the nested dicts that the vendor's package gives."""
    from .codec import decode, encode

    return decode(METAOBJECT, b"".join(encode(METAOBJECT, meta.to_value())))
