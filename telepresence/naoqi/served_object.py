"""An object that others call over the wire: methods, signals and properties, and the actions that every object has.

`handle` runs on the reactor's thread and only sorts: what is a table lookup is answered there, and what has a quick
answer; everything else that may run the code of a user goes to a worker. An object that is not parallel runs one call
at a time, in the order of arrival over all connections; one whose method returns a future is free at once, and the
reply follows when the future ends.
"""

from __future__ import annotations

import functools
import logging
import os
import threading
from typing import TYPE_CHECKING, Any, Callable, NamedTuple

from . import workers
from .codec import decode, encode, encode_arguments, encode_dynamic
from .conversion import convert
from .dynamics import Typed
from .incoming_call import Call, Method
from .message import CALL, DYNAMIC_PAYLOAD, POST, Header
from .metaobject import BUILT_IN, METAOBJECT, MetaMethod, MetaObject, MetaProperty, MetaSignal
from .signature import WireError

if TYPE_CHECKING:
    from .connection import Connection

log = logging.getLogger(__name__)

FIRST_UID = 100
UID_BYTES = 20
REGISTER_EVENT, UNREGISTER_EVENT, META_OBJECT, TERMINATE = 0, 1, 2, 3
GET_PROPERTY, SET_PROPERTY, PROPERTIES, REGISTER_EVENT_WITH_SIGNATURE = 5, 6, 7, 8


class Subscription(NamedTuple):
    """A peer's link to a signal; `signature` is "" unless it wants the values converted."""

    connection: Connection
    service: int
    object: int
    uid: int
    signature: str


class ServedObject:
    """Methods, signals and properties under numbers, callable from any connection.

    Args:
        description: What the metaobject says about it.
        parallel: Calls run side by side; otherwise one at a time in order of arrival, as libqi does by default.
        strand: What such an object shares with others, so that one runs at a time among all of them.
        strict: Arguments that cannot be converted are refused; otherwise the function gets them as they came and
            refuses them in its own words, as Python methods do behind libqi.
    """

    def __init__(
        self,
        description: str = "",
        parallel: bool = True,
        strand: workers.Strand | None = None,
        strict: bool = True,
    ) -> None:
        self.uid = os.urandom(UID_BYTES)
        self.description = description
        self.strict = strict
        self._strand = None if parallel else workers.Strand() if strand is None else strand  # an empty one is false
        self._methods: dict[int, Method] = {}
        self._signals: dict[int, Any] = {}
        self._properties: dict[int, Any] = {}
        self._meta = MetaObject(dict(BUILT_IN), {}, {}, description)
        self._encoded_meta: list[Any] | None = None
        self._next_uid = FIRST_UID
        self._lock = threading.Lock()
        self._links: dict[int, dict[tuple[Connection, int, int], Subscription]] = {}
        self._own_links: dict[int, int] = {}
        self._changes = workers.Strand()

    # --- what it consists of

    @property
    def meta(self) -> MetaObject:
        """What the peers get to know about it."""
        return self._meta

    def encoded_meta(self) -> list[Any]:
        """Return the metaobject as it goes over the wire."""
        if self._encoded_meta is None:
            self._encoded_meta = [b"".join(encode(METAOBJECT, self._meta.to_value()))]
        return self._encoded_meta

    def add_method(
        self,
        name: str,
        returns: str,
        parameters: str,
        function: Callable[..., Any],
        description: str = "",
        *,
        uid: int | None = None,
        inline: bool = False,
        connection_first: bool = False,
        quick: Callable[..., Any] | None = None,
    ) -> int:
        """Add a method and return its number.

        Args:
            returns, parameters: Signatures, such as "b" and "(si)"; "m" as parameters takes any arguments.
            function: Gets the decoded arguments. Returns a value, a Future of this package or of concurrent.futures;
                what it raises is sent to the caller as str(error).
            quick: Gets the same arguments first, if they are short, on the thread that serves all connections; it
                answers without waiting for anything, or raises NotNow. That saves two changes of threads. Only for
                objects whose calls run side by side.
        """
        number = self._take(uid)
        self._methods[number] = Method(
            *(number, returns, name, parameters, function, inline, connection_first, self.strict, quick)
        )
        self._meta.methods[number] = MetaMethod(number, returns, name, parameters, description)
        return number

    def add_signal(self, name: str, signal: Any, uid: int | None = None) -> int:
        """Add a Signal and return its number."""
        number = self._take(uid)
        self._signals[number] = signal
        self._meta.signals[number] = MetaSignal(number, name, signal.signature)
        return number

    def add_property(self, name: str, prop: Any, uid: int | None = None) -> int:
        """Add a Property and return its number, which is also that of the signal of its changes."""
        number = self._take(uid)
        self._properties[number] = self._signals[number] = prop
        self._meta.properties[number] = MetaProperty(number, name, prop.signature)
        self._meta.signals[number] = MetaSignal(number, name, f"({prop.signature})")
        return number

    def _take(self, uid: int | None) -> int:
        with self._lock:
            number = self._next_uid if uid is None else uid
            self._next_uid = max(self._next_uid, number + 1)
            self._encoded_meta = None
            return number

    # --- what peers ask

    def handle(self, connection: Connection, header: Header, payload: Any) -> None:
        """Take a CALL or POST; on the reactor's thread."""
        action = header.action
        method = self._methods.get(action)
        if method is not None:
            call = Call(connection, header, payload, method)
            if method.inline:
                call.run()
            elif self._strand is not None or not call.run_quick():
                self._later(call)
        elif action in (GET_PROPERTY, SET_PROPERTY, PROPERTIES):
            self._later(Call(connection, header, payload, self._property_method(action)))
        elif action in (REGISTER_EVENT, UNREGISTER_EVENT, REGISTER_EVENT_WITH_SIGNATURE):
            self._subscribe(connection, header, payload)
        elif action == META_OBJECT:
            if header.kind == CALL:
                connection.reply(header, self.encoded_meta())
        elif action == TERMINATE:
            if connection.references.terminate(header.service, header.object):
                self.forget(connection, header.object)
            if header.kind == CALL:
                connection.reply(header, [])
        elif action in self._signals and header.kind == POST:
            signal = self._signals[action]
            self._later(Call(connection, header, payload, self._emission(signal, self._meta.signals[action])))
        else:
            text = f"No such method {{{header.service}.{header.object}.{action}, id:{header.identity}}}"
            connection.error(header, text)

    def _later(self, call: Call) -> None:
        if not call.begin():
            return
        if self._strand is None:
            call.connection.work(call.run)
        else:
            self._strand.submit(call.run)

    @staticmethod
    def _emission(signal: Any, meta: MetaSignal) -> Method:
        return Method(meta.uid, "v", meta.name, meta.signature, signal)

    def _property_method(self, action: int) -> Method:
        if action == GET_PROPERTY:
            return Method(action, "m", "property", "(m)", lambda key: self._property(key).value())
        if action == SET_PROPERTY:
            return Method(action, "v", "setProperty", "(mm)", lambda key, value: self._property(key).setValue(value))
        names = [meta.name for meta in self._meta.properties.values()]
        return Method(action, "[s]", "properties", "()", lambda: names)

    def _property(self, key: Any) -> Any:
        if isinstance(key, int) and key in self._properties:
            return _Typed(self._properties[key])
        for uid, meta in self._meta.properties.items():
            if meta.name == key:
                return _Typed(self._properties[uid])
        raise WireError(f'property "{key}" was not found')

    # --- signals

    def _subscribe(self, connection: Connection, header: Header, payload: Any) -> None:
        """Take a registerEvent, unregisterEvent or registerEventWithSignature."""
        try:
            action, signature = header.action, ""
            if action == REGISTER_EVENT_WITH_SIGNATURE:
                _, uid, link, signature = decode("(IILs)", payload)
            else:
                _, uid, link = decode("(IIL)", payload)
            if action == UNREGISTER_EVENT:
                self._unlink(connection, header, uid, link)
            else:
                self._link(connection, header, uid, link, signature)
        except (WireError, RuntimeError) as error:
            return connection.error(header, str(error))
        work = functools.partial(self._settle, connection, header, uid, link)
        # Whoever made the signal may want to know of its first and its last subscriber, and that is user code.
        if getattr(self._signals.get(uid), "watched", False):
            self._changes.submit(work)
        else:
            work()

    def _link(self, connection: Connection, header: Header, uid: int, link: int, signature: str) -> None:
        if uid not in self._signals:
            raise WireError(f"Register request failed for {link} {header.object}: there is no signal {uid}")
        with self._lock:
            links = self._links.setdefault(uid, {})
            key = (connection, header.object, link)
            if key not in links:
                if sum(connection.subscribed.values()) >= connection.limits.subscriptions:
                    raise WireError(f"more than {connection.limits.subscriptions} subscriptions")
                connection.subscribed[self] = connection.subscribed.get(self, 0) + 1
            links[key] = Subscription(connection, header.service, header.object, uid, signature)
        if connection.closed:  # it has dropped its links before this one was made
            self.forget(connection)

    def _unlink(self, connection: Connection, header: Header, uid: int, link: int) -> None:
        with self._lock:
            if self._links.get(uid, {}).pop((connection, header.object, link), None) is None:
                raise WireError(f"Unregister request failed for {link} {header.object}")
            self._count_down(connection, 1)

    def _count_down(self, connection: Connection, links: int) -> None:
        """A connection has so many links less. The lock is held."""
        left = connection.subscribed.get(self, 0) - links
        if left > 0:
            connection.subscribed[self] = left
        else:
            connection.subscribed.pop(self, None)

    def _settle(self, connection: Connection, header: Header, uid: int, link: int) -> None:
        """Follow the signal if anybody does, and answer."""
        self._follow(uid)
        if header.kind == CALL:
            connection.reply(header, [] if header.action == UNREGISTER_EVENT else encode("L", link))

    def _follow(self, uid: int) -> None:
        with self._lock:
            wanted, own = bool(self._links.get(uid)), self._own_links.get(uid)
            if wanted and own is None:
                self._own_links[uid] = -1
            elif not wanted and own is not None:
                del self._own_links[uid]
            else:
                return
        signal = self._signals[uid]
        if wanted:
            self._own_links[uid] = signal.connect_direct(functools.partial(self._emit, uid))
        else:
            signal.disconnect(own)

    def forget(self, connection: Connection, number: int | None = None) -> None:
        """A connection has ended, or its peer has released the object with this number: drop its links.

        On any thread.
        """
        touched = []
        with self._lock:
            for uid, links in self._links.items():
                gone = [key for key in links if key[0] is connection and number in (None, key[1])]
                for key in gone:
                    del links[key]
                if gone:
                    touched.append(uid)
                    self._count_down(connection, len(gone))
        for uid in touched:
            self._changes.submit(self._follow, uid)

    def _emit(self, uid: int, *values: Any) -> None:
        """Send an event to everybody who has subscribed; in the emitting thread, which never waits."""
        with self._lock:
            subscriptions = list(self._links.get(uid, {}).values())
        signature = self._meta.signals[uid].signature
        made: dict[tuple[str, Any], tuple[list[Any], int]] = {}
        for one in subscriptions:
            key = (one.signature, one.connection.dialect)
            try:
                if key not in made:
                    try:
                        made[key] = _event_payload(signature, values, one, None)
                    except WireError:  # it may hold objects, which have another number on every connection
                        payload, flags = _event_payload(signature, values, one, one.connection.objects(one.service))
                        one.connection.event(one.service, one.object, uid, payload, flags)
                        continue
                payload, flags = made[key]
                one.connection.event(one.service, one.object, uid, payload, flags)
            except (RuntimeError, ValueError, TypeError) as error:
                log.warning("signal %s: %s", self._meta.signals[uid].name, error)


def _event_payload(signature: str, values: tuple, one: Subscription, objects: Any) -> tuple[list[Any], int]:
    """Return payload and flags of an event. Values that do not fit the signature go as a dynamic."""
    dialect = one.connection.dialect
    if one.signature and one.signature != signature:
        try:
            converted = convert(values, one.signature)
            return encode_dynamic(converted, one.signature, objects=objects, dialect=dialect), DYNAMIC_PAYLOAD
        except WireError:
            log.debug("an event cannot be converted to %s", one.signature)
    if signature == "m":
        return encode("m", tuple(values), objects=objects, dialect=dialect), 0
    return encode_arguments(signature, values, objects=objects, dialect=dialect), 0


class _Typed:
    """A property as its peers see it: the value in the declared type, whatever the dialect."""

    def __init__(self, prop: Any) -> None:
        self._property = prop

    def value(self) -> Any:
        signature, value = self._property.signature, self._property.value()
        return value if signature == "m" else Typed(signature, value)

    def setValue(self, value: Any) -> None:
        self._property.setValue(value)
