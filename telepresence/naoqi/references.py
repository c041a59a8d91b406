"""Objects that cross a connection by reference: in the one direction they are served there, in the other they are
proxies, whose calls go back over the same connection.

    MetaObjectCache shared:  bool, a MetaObject if it is true, uint32 its number in the sender's cache
    otherwise:               MetaObject
    then                     uint32 service, uint32 object, and if ObjectPtrUID is shared 20 bytes of identity
"""

from __future__ import annotations

import itertools
import logging
import struct
import threading
from typing import TYPE_CHECKING, Any

from .codec import decode_from, encode
from .metaobject import METAOBJECT, MetaObject
from .served_object import UID_BYTES, ServedObject
from .signature import WireError

if TYPE_CHECKING:
    from .connection import Connection

log = logging.getLogger(__name__)

_FIRST_OF_SERVER = 3
_FIRST_OF_CLIENT = 1 << 31
_LAYOUTS = ((False, False), (False, True), (True, False), (True, True))
"""(MetaObjectCache, ObjectPtrUID)"""
_CACHED = 4096
"""Metaobjects remembered of one peer."""
_numbers = itertools.count(_FIRST_OF_SERVER)


class References:
    """The references of one connection.

    Attributes:
        hosted: What is served to this peer only: (service, object) -> object.
    """

    def __init__(self, connection: Connection) -> None:
        self.hosted: dict[tuple[int, int], ServedObject] = {}
        self._connection = connection
        self._numbers = itertools.count(_FIRST_OF_CLIENT) if connection.dialled else _numbers
        self._lock = threading.Lock()
        self._coders: dict[int, ReferenceCoder] = {}
        self._sent: dict[bytes, int] = {}
        self._received: dict[int, MetaObject] = {}
        self._layout: tuple[bool, bool] | None = None

    def of(self, service: int) -> ReferenceCoder:
        """Return the coder for messages of a service."""
        coder = self._coders.get(service)
        if coder is None:
            coder = self._coders[service] = ReferenceCoder(self, service)
        return coder

    def host(self, service: int, served: ServedObject) -> int:
        """Serve an object to this peer and return its number.

        Raises: WireError: The peer holds too many.
        """
        with self._lock:
            if len(self.hosted) >= self._connection.limits.references:
                raise WireError(f"more than {self._connection.limits.references} objects were given to one peer")
            number = next(self._numbers)
            self.hosted[service, number] = served
            return number

    def terminate(self, service: int, number: int) -> bool:
        """The peer has released an object; return whether it held it. Main objects are not concerned."""
        return self.hosted.pop((service, number), None) is not None

    def drop_service(self, service: int) -> None:
        """A service has gone, and with it the objects that it gave away."""
        for key in [key for key in list(self.hosted) if key[0] == service]:
            self.hosted.pop(key, None)

    def clear(self) -> None:
        """The connection has ended."""
        self.hosted.clear()
        self._coders.clear()

    def write(self, service: int, value: Any) -> bytes:
        """Return a reference to an object of ours, which is served from now on.

        Raises: WireError: It is no object that can be served.
        """
        connection = self._connection
        meta: list[Any]
        if value is None:
            meta, number, uid = encode(METAOBJECT, MetaObject().to_value()), 0, bytes(UID_BYTES)
            service = 0
        else:
            target = value if isinstance(value, ServedObject) else _served(value)
            meta, uid = target.encoded_meta(), target.uid
            number = self.host(service, target)
        parts = list(meta)
        cache, has_uid = self._layout or (connection.shared("MetaObjectCache"), connection.shared("ObjectPtrUID"))
        if cache:
            whole = b"".join(parts)
            with self._lock:
                # Sent whole every time: messages of other threads may overtake the first one.
                at = self._sent.setdefault(whole, len(self._sent) + 1) if len(self._sent) < _CACHED else 0xFFFFFFFF
            parts = [b"\1", whole, struct.pack("<I", at)]
        parts.append(struct.pack("<II", service, number))
        if has_uid:
            parts.append(uid)
        return b"".join(parts)

    def read(self, payload: Any, offset: int) -> tuple[Any, int]:
        """Return a proxy for the reference at `offset`, None for the null object, and where it ends.

        Raises: WireError: There is none.
        """
        connection = self._connection
        agreed = self._layout or (connection.shared("MetaObjectCache"), connection.shared("ObjectPtrUID"))
        alone = offset == 0 or (offset == 5 and bytes(payload[:5]) == b"\1\0\0\0o")
        found = self._try(payload, offset, agreed)
        if alone and (found is None or found[-1] != len(payload)):
            # The gateway of NAOqi 2.5 passes on what the service wrote, whatever was agreed with us.
            for layout in _LAYOUTS:
                other = self._try(payload, offset, layout)
                if other is not None and other[-1] == len(payload):
                    found, self._layout = other, layout
                    break
        if found is None:
            raise WireError("there is no object reference")
        meta, cached, service, number, uid, end = found
        if cached is not None:
            if len(self._received) >= _CACHED:
                self._received.clear()
            self._received[cached] = meta
        return (self._proxy(service, number, meta, uid) if number else None), end

    def _try(self, payload: Any, offset: int, layout: tuple[bool, bool]) -> tuple | None:
        """Return (metaobject, its number in the cache, service, object, uid, end), or None if the bytes are no such."""
        cache, has_uid = layout
        try:
            at, transmitted, cached = offset, True, None
            if cache:
                if payload[at] > 1:
                    return None
                transmitted, at = bool(payload[at]), at + 1
            if transmitted:
                value, at = decode_from(METAOBJECT, payload, at)
                meta = MetaObject.from_value(value)
            if cache:
                (cached,) = struct.unpack_from("<I", payload, at)
                at += 4
                if not transmitted:
                    meta = self._received[cached]
                    cached = None
                elif cached == 0xFFFFFFFF:
                    cached = None
            service, number = struct.unpack_from("<II", payload, at)
            at += 8
            uid = bytes(payload[at : at + UID_BYTES]) if has_uid else b""
            at += UID_BYTES if has_uid else 0
        except (WireError, struct.error, IndexError, KeyError):
            return None
        return (meta, cached, service, number, uid, at) if at <= len(payload) else None

    def _proxy(self, service: int, number: int, meta: MetaObject, uid: bytes) -> Any:
        from .proxy import Proxy  # imports the connection, as the next does
        from .remote_object import RemoteObject

        return Proxy(RemoteObject(self._connection, service, number, meta, reference=True, uid=uid))


class ReferenceCoder:
    """What the codec asks about objects in messages of one service."""

    __slots__ = ("_references", "_service")

    def __init__(self, references: References, service: int) -> None:
        self._references, self._service = references, service

    def write(self, value: Any) -> bytes:
        return self._references.write(self._service, value)

    def read(self, payload: Any, offset: int) -> tuple[Any, int]:
        return self._references.read(payload, offset)


def _served(value: Any) -> ServedObject:
    from .python_object import served  # which imports the connection

    return served(value)
