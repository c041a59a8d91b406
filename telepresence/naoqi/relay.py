"""An object at the other end of one connection, served on others: each call is passed on, and so is the answer.

By this a proxy can be given to somebody else, and a client's service can be reached through the server although the
client does not listen anywhere.
"""

from __future__ import annotations

import functools
from typing import Any

from .future import Future
from .metaobject import BUILT_IN, FIRST_OWN_ID, MetaMethod
from .remote_object import RemoteObject
from .remote_signal import RemoteSignal
from .served_object import GET_PROPERTY, PROPERTIES, Method, ServedObject
from .signals import Signal


class Relay(ServedObject):
    """Serves what a remote object offers, under the same numbers."""

    def __init__(self, remote: RemoteObject, uid: bytes = b"") -> None:
        super().__init__(remote.meta.description)
        self.uid = uid or self.uid
        self._remote = remote
        for method in remote.meta.methods.values():
            if method.uid >= FIRST_OWN_ID:
                call = functools.partial(self._call, method)
                self.add_method(
                    method.name, method.returns, method.parameters, call, method.description, uid=method.uid
                )
        for signal in remote.meta.signals.values():
            if signal.uid >= FIRST_OWN_ID:
                self._relay_signal(signal.uid, signal.name, signal.signature)
        self.meta.properties.update(remote.meta.properties)

    def _call(self, method: MetaMethod, *arguments: Any) -> Future:
        return self._remote.call(method, arguments)

    def _property_method(self, action: int) -> Method:
        if action == PROPERTIES:
            return super()._property_method(action)
        method = BUILT_IN[action]
        returns = "m" if action == GET_PROPERTY else "v"
        return Method(action, returns, method.name, method.parameters, functools.partial(self._call, method))

    def _relay_signal(self, uid: int, name: str, signature: str) -> None:
        """Subscribe to the remote signal while somebody is subscribed here."""
        source = RemoteSignal(self._remote, uid, name, signature)
        links: list[int] = []

        def follow(wanted: bool) -> None:
            if wanted:
                links.append(source.connect(signal))
            elif links:
                source.disconnect(links.pop())

        signal = Signal(signature, follow)
        self.add_signal(name, signal, uid=uid)
