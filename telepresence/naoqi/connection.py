"""One connection between two NAOqi ends. Both are peers: whoever dialled, calls go both ways over it.

Everything that arrives is handled on the reactor's thread and never waits: replies complete their calls, events go to
their handlers, calls to objects (`served_object.py`), which put them on workers.
"""

from __future__ import annotations

import collections
import itertools
import logging
import os
import socket
import struct
import threading
import time
import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Callable

from . import workers
from .codec import decode, encode
from .dynamics import PYTHON, Dialect, Typed
from .limits import Limits
from .message import CALL, CANCEL, CANCELED, CAPABILITY, ERROR, EVENT, POST, REPLY, Header
from .reactor import reactor
from .signature import WireError
from .stream import Stream

if TYPE_CHECKING:
    from .references import References
    from .served_object import ServedObject

log = logging.getLogger(__name__)

LOST = 0
"""Given to a call's `done` instead of a message's kind: the connection has ended, the payload is the reason."""
_CHECK_S = 2.0
_AUTHENTICATE = 8
_LOST_TEXT = "Socket is not connected"

Done = Callable[[int, int, Any], None]
"""done(kind, flags, payload): how a call ended. On the reactor's thread, so it must be quick."""

_live: weakref.WeakSet[Connection] = weakref.WeakSet()


class Connection:
    """Calls, replies, events and hosted objects of one stream.

    Args:
        stream: A connected socket.
        capabilities: What this end announces.
        dialled: This end has connected, and so it numbers its objects from 2^31.

    Attributes:
        peer: Address of the other end, for people.
        url: What was dialled, "" if the other end did.
        ends: Addresses of both ends of its TCP connection as `socket` has them, the peer's first; None without one.
        here, there: Address of this end, and of the other one if it was dialled.
        local, remote: Capabilities announced by either end.
        lookup: Set by the owner: (service, object) -> the object served there, or None.
        before_login: Set until the login is over: gets every message that is not a reply.
        close_reason: Why it ended, "" before.
    """

    def __init__(
        self,
        stream: socket.socket,
        *,
        capabilities: dict[str, bool],
        limits: Limits = Limits(),  # noqa: B008 -- frozen
        dialect: Dialect = PYTHON,
        dialled: bool = False,
        peer: str = "",
    ) -> None:
        self.limits = limits
        self.dialect = dialect
        self.peer = peer
        self.url = ""
        self.ends = _ends(stream)
        self.here = str(self.ends[1][0]) if self.ends is not None else ""
        self.there = ""
        self.dialled = dialled
        self.local = dict(capabilities)
        self.remote: dict[str, Any] = {}
        self.lookup: Callable[[int, int], ServedObject | None] = lambda service, obj: None
        self.before_login: Callable[[Header, Any], None] | None = None
        self.close_reason = ""
        self.opened_at = time.monotonic()
        self.running: dict[int, Any] = {}  # calls of the peer that are not answered, by id
        self.running_bytes = 0
        self.subscribed: dict[ServedObject, int] = {}  # how many links it has to which object
        self.registrations: dict[tuple[int, int, int], Any] = {}  # this end's subscriptions, see `remote_signal.py`
        self._socket = stream
        self._identities = itertools.count(1)
        self._calls: dict[int, Done] = {}
        self._calls_lock = threading.Lock()
        self._handlers: dict[tuple[int, int, int], Callable[[int, Any], None]] = {}
        self._closed_callbacks: list[Callable[[str], None]] = []
        self._references: References | None = None
        self._held = False
        self._working = 0
        self._waiting: collections.deque[Callable[[], None]] = collections.deque()
        self._reactor = reactor()
        self._stream = Stream(stream, self._reactor, limits, self.message, self._ended)
        _live.add(self)

    def start(self) -> None:
        """Begin to read. Set `lookup` and `before_login` before."""
        self._stream.start()
        if self.dialled:
            self._reactor.call_later(_CHECK_S, _check_later, weakref.ref(self))

    @property
    def closed(self) -> bool:
        return self._stream.ended

    @property
    def references(self) -> References:
        """The objects that have crossed this connection."""
        if self._references is None:
            from .references import References  # imports this module

            self._references = References(self)
        return self._references

    def objects(self, service: int) -> Any:
        """Return the coder of object references that travel in the context of a service."""
        return self.references.of(service)

    def shared(self, capability: str) -> bool:
        """Whether both ends announced it."""
        return bool(self.local.get(capability)) and bool(self.remote.get(capability))

    def learn(self, capabilities: dict[str, Any]) -> None:
        """Add capabilities that the peer announces; known ones stay.

        Raises: WireError: There are too many.
        """
        for name, value in capabilities.items():
            self.remote.setdefault(name, value)
        if len(self.remote) > self.limits.capabilities:
            raise WireError(f"{len(self.remote)} capabilities, at most {self.limits.capabilities} are taken")

    def trust(self) -> None:
        """The peer is logged in: messages of full size, and calls of every object."""
        self.before_login = None
        self._stream.trust()

    def soon(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Run a short function on the reactor's thread; may be called from a finalizer."""
        self._reactor.call_soon(function, *arguments)

    # --- what this end says

    def start_call(
        self, service: int, object_id: int, action: int, payload: Sequence[Any], flags: int, done: Done
    ) -> int:
        """Send a CALL; return its id. `done` is called exactly once, also when the connection is or gets lost."""
        identity = next(self._identities) & 0xFFFFFFFF
        with self._calls_lock:
            if not self._stream.ended:
                self._calls[identity] = done
                done_at_once = None
            else:
                done_at_once = done
        if done_at_once is not None:
            done_at_once(LOST, 0, _LOST_TEXT)
            return identity
        self.send(CALL, service, object_id, action, payload, flags, identity)
        return identity

    def cancel_call(self, identity: int, service: int = 0, object_id: int = 0) -> bool:
        """Ask the peer to end a call; return whether it understands that. The call ends by `done` as any."""
        if identity not in self._calls or not self.shared("RemoteCancelableCalls"):
            return False
        return self.send(CANCEL, service, object_id, 0, [struct.pack("<I", identity)])

    def post(self, service: int, object_id: int, action: int, payload: Sequence[Any], flags: int = 0) -> bool:
        """Send a call without an answer, or trigger a signal; return whether it was sent."""
        return self.send(POST, service, object_id, action, payload, flags, droppable=True)

    def event(self, service: int, object_id: int, action: int, payload: Sequence[Any], flags: int = 0) -> bool:
        """Send an event; return False if it was dropped because the peer does not read."""
        return self.send(EVENT, service, object_id, action, payload, flags, droppable=True)

    def reply(self, header: Header, payload: Sequence[Any], kind: int = REPLY, flags: int = 0) -> None:
        """Answer the call with this header."""
        self.send(kind, header.service, header.object, header.action, payload, flags, header.identity)

    def error(self, header: Header, text: str) -> None:
        """Answer a call with an error; posts get none."""
        if header.kind == CALL:
            self.reply(header, encode("m", text), ERROR)

    def send(
        self,
        kind: int,
        service: int,
        object_id: int,
        action: int,
        payload: Sequence[Any],
        flags: int = 0,
        identity: int | None = None,
        droppable: bool = False,
    ) -> bool:
        """Send one message; return whether it was taken."""
        if identity is None:
            identity = next(self._identities) & 0xFFFFFFFF
        size = sum(map(len, payload))
        header = Header(identity, size, kind, flags, service, object_id, action).pack()
        return self._stream.send([header, *payload], droppable)

    # --- events of the peer

    def on_event(self, service: int, object_id: int, uid: int, handler: Callable[[int, Any], None]) -> None:
        """Call `handler(flags, payload)` for each event of that signal, on the reactor's thread."""
        self._handlers[service, object_id, uid] = handler

    def off_event(self, service: int, object_id: int, uid: int) -> None:
        """Forget the handler, if any."""
        self._handlers.pop((service, object_id, uid), None)

    # --- the end

    def on_close(self, callback: Callable[[str], None]) -> None:
        """Call `callback(reason)` once when the connection ends, or now if it has; quick, on any thread."""
        with self._calls_lock:
            if not self.close_reason:
                self._closed_callbacks.append(callback)
                return
        callback(self.close_reason)

    def close(self, reason: str = "Session closed", abort: bool = False) -> None:
        """End the connection; pending calls fail with the reason.

        Args:
            abort: The peer counts as lost, and what it has not got is not sent any more; see `Stream.end`.
        """
        self._stream.end(reason, abort)

    def finish(self, reason: str) -> None:
        """End the connection after what is waiting has been sent."""
        self._stream.finish(reason)

    def check(self, now: float) -> None:
        """End the connection if the peer is stuck, or its login takes too long. `now`: time.monotonic()."""
        if self.before_login is not None and not self.dialled and now - self.opened_at > self.limits.login_s:
            self.close(f"no login within {self.limits.login_s:g} s")
        else:
            self._stream.check(now)

    def _ended(self, reason: str) -> None:
        log.debug("%s: %s", self.peer, reason)
        with self._calls_lock:
            self.close_reason = reason or _LOST_TEXT
            calls, self._calls = self._calls, {}
            callbacks, self._closed_callbacks = self._closed_callbacks, []
        self._handlers.clear()
        for done in calls.values():
            done(LOST, 0, self.close_reason)
        for served in list(self.subscribed):
            served.forget(self)
        self.subscribed.clear()
        if self._references is not None:
            self._references.clear()
        for callback in callbacks:
            try:
                callback(self.close_reason)
            except Exception:
                log.exception("a callback at the end of a connection failed")

    # --- what the peer says; all on the reactor's thread

    def message(self, header: Header, payload: Any) -> None:
        """Take a message."""
        kind = header.kind
        if kind in (REPLY, ERROR, CANCELED):
            done = self._calls.pop(header.identity, None)
            if done is not None:
                done(kind, header.flags, payload)
        elif self.before_login is not None:
            self.before_login(header, payload)
        elif kind in (CALL, POST):
            self._called(header, payload)
        elif kind == EVENT:
            handler = self._handlers.get((header.service, header.object, header.action))
            if handler is not None:
                handler(header.flags, payload)
        elif kind == CAPABILITY:
            self.learn(decode("{sm}", payload))
        elif kind == CANCEL:
            self._cancelled(payload)
        else:
            log.debug("%s: a message of unknown kind %d", self.peer, kind)

    def _called(self, header: Header, payload: Any) -> None:
        if header.version:
            text = f"remote end doesn't support binary protocol v{header.version}"
            return self.error(header, f"Cannot negotiate QiMessaging connection: {text}")
        served = self._references and self._references.hosted.get((header.service, header.object))
        served = served or self.lookup(header.service, header.object)
        if served is not None:
            served.handle(self, header, payload)
        elif (header.service, header.object, header.action) == (0, 0, _AUTHENTICATE) and not self.dialled:
            self.reply(header, encode("{sm}", {"__qi_auth_state": Typed("I", 3)}))
        else:
            self.error(header, "The call request could not be handled.")

    def _cancelled(self, payload: Any) -> None:
        if len(payload) < 4:
            raise WireError("a CANCEL without the id of a call")
        call = self.running.get(struct.unpack_from("<I", payload)[0])
        if call is not None:
            workers.submit(call.cancel)

    # --- calls that are not answered yet

    def begin(self, identity: int, call: Any, size: int) -> bool:
        """Count a call of the peer; return False if there are far too many. On the reactor's thread.

        Above `Limits.pending_calls` no more is read from the peer until some are answered, unless calls of ours wait
        for its answers: these would not arrive. Then eight times as many are taken, and the others are refused.
        """
        limit, largest = self.limits.pending_calls, self.limits.pending_bytes
        if len(self.running) >= 8 * limit or self.running_bytes > 2 * largest:
            return False
        self.running[identity] = call
        with self._calls_lock:
            self.running_bytes += size
        if (len(self.running) > limit or self.running_bytes > largest) and not self._calls and not self._held:
            self._held = True
            self._stream.pause()
            self._reactor.call_soon(self._read_on)  # they may all have been answered just now
        return True

    def work(self, run: Callable[[], None]) -> None:
        """Run a call of the peer on a worker; those of one peer take at most `Limits.working_calls` of them."""
        with self._calls_lock:
            if self._working >= self.limits.working_calls:
                self._waiting.append(run)
                return
            self._working += 1
        workers.submit(self._work, run)

    def _work(self, run: Callable[[], None]) -> None:
        try:
            run()
        finally:
            with self._calls_lock:
                following = self._waiting.popleft() if self._waiting else None
                if following is None:
                    self._working -= 1
            if following is not None:
                workers.submit(self._work, following)

    def finished(self, identity: int, call: Any, size: int) -> None:
        """A call of the peer has been answered; from any thread."""
        if self.running.get(identity) is call:
            del self.running[identity]
        with self._calls_lock:
            self.running_bytes -= size
        if self._held:
            self._reactor.call_soon(self._read_on)

    def _read_on(self) -> None:
        few = (
            len(self.running) <= self.limits.pending_calls // 2 and self.running_bytes <= self.limits.pending_bytes // 2
        )
        if self._held and few:
            self._held = False
            self._stream.resume()


def _check_later(reference: weakref.ref[Connection]) -> None:
    """Look after a dialled connection; a server looks after all of its own at once."""
    connection = reference()
    if connection is not None and not connection.closed:
        connection.check(time.monotonic())
        reactor().call_later(_CHECK_S, _check_later, reference)


def _ends(stream: socket.socket) -> tuple[tuple[Any, ...], tuple[Any, ...]] | None:
    try:
        peer, own = stream.getpeername(), stream.getsockname()
    except OSError:
        return None
    # A pair of sockets inside a process has no addresses.
    return (peer, own) if isinstance(peer, tuple) and isinstance(own, tuple) else None


def _after_fork() -> None:
    """A forked child has copies of the sockets: close them, or the peers would not see the parent's end."""
    for connection in list(_live):
        connection._stream.close_copy()
    _live.clear()


os.register_at_fork(after_in_child=_after_fork)
