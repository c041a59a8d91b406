"""A session: a connection to a robot's service directory and what is reached by it. The interface is the vendor's.

Every step that waits for the other side has a time limit (`ANSWER_S`), except calls of services, as in the vendor's
package: a method may take as long as it wants, and a lost connection ends them.
"""

from __future__ import annotations

import os
import socket
import ssl
import sys
import threading
import uuid
import weakref
from collections.abc import Callable, Sequence
from typing import Any

from .connection import Connection, connect, split_url
from .dynamics import PYTHON
from .future import INFINITE, Future, describe, failed
from .login import log_in
from .metaobject import METAOBJECT, MetaObject, choose_overload
from .proxy import Proxy, proxy_of
from .python_object import served
from .reactor import reactor
from .releases import CLIENT_CAPABILITIES
from .remote_object import RemoteObject, forget_registrations
from .routing import candidates, dialable, is_loopback, normal, stays
from .served_object import ServedObject
from .server import Server
from .signals import Signal
from .signature import parse
from .workers import submit

DEFAULT_URL = "tcp://127.0.0.1:9559"
CONNECT_S = 10.0
"""To connect and to log in, each [s]."""
ANSWER_S = 10.0
"""For every answer of the service directory, and for the description of a service [s]."""
SESSION_CLOSED = "Session closed"
NOT_CONNECTED = "Session not connected."
_META_OBJECT = 2
_INFO_FIELDS = ("name", "serviceId", "machineId", "processId", "endpoints", "sessionId", "objectUid")

_sessions: weakref.WeakSet[Session] = weakref.WeakSet()


class _Link:
    """One connection to a directory, and everything that ends with it."""

    def __init__(self, url: str, connection: Connection, tls: ssl.SSLContext | None) -> None:
        self.url = url
        self.connection = connection
        self.tls = tls
        self.machine_id = ""
        self.endpoints: list[str] | None = None
        self.directory: RemoteObject = None  # type: ignore[assignment]  # set when its description has come
        self.routes: dict[tuple[str, str], Connection] = {}
        self.remotes: dict[str, RemoteObject] = {}
        self.own: dict[int, tuple[str, ServedObject]] = {}
        self.local: tuple[Connection, Connection] | None = None

    def connections(self) -> list[Connection]:
        """Return all connections, the directory's last."""
        others = {id(one): one for one in [*self.routes.values(), *(self.local or ())] if one is not self.connection}
        return [*others.values(), self.connection]


class _Watcher:
    """What connections hold of a session: not the session itself, so that one that nobody uses any more ends.

    Its methods are called back one at a time, so that what the directory reports is handled in order.
    """

    def __init__(self, session: Session) -> None:
        self._session = weakref.ref(session)

    def added(self, number: int, name: str) -> None:
        if (session := self._session()) is not None:
            session.serviceRegistered(number, name)

    def removed(self, number: int, name: str) -> None:
        if (session := self._session()) is not None:
            session._service_removed(number, name)

    def lookup(self, service: int, object: int) -> ServedObject | None:
        session = self._session()
        return None if session is None else session._lookup(service, object)

    def lost(self, link: _Link) -> None:
        if (session := self._session()) is not None:
            session._lost(link)


class Session:
    """A client of a robot, or with `listenStandalone` a robot of one's own.

    Signals: connected(), disconnected(reason), serviceRegistered(id, name), serviceUnregistered(id, name).
    All errors are RuntimeErrors. Every method takes `_async=True` and then returns a Future. A session that nobody
    holds any more closes, and its proxies with it.
    """

    def __init__(self) -> None:
        self.connected = Signal("()")
        self.disconnected = Signal("(s)")
        self.serviceRegistered = Signal("(Is)")
        self.serviceUnregistered = Signal("(Is)")
        self._lock = threading.RLock()
        self._dialling = threading.Lock()
        self._link: _Link | None = None
        self._connecting = False
        self._factory: Any = None
        self._server: Server | None = None
        self._listeners: list[Server] = []
        self._id = str(uuid.uuid4())
        self._watcher = _Watcher(self)
        _sessions.add(self)

    def __del__(self) -> None:
        # A finalizer may run anywhere: it leaves the work to others.
        if sys.is_finalizing() or (getattr(self, "_link", None) is None and not getattr(self, "_listeners", None)):
            return
        for connection in self._link.connections() if self._link is not None else []:
            reactor().call_soon(connection.close, SESSION_CLOSED)
        for server in [*self._listeners, self._server]:
            if server is not None:
                reactor().call_soon(submit, server.close)

    def __repr__(self) -> str:
        link = self._link
        return f"<Session connected to {link.url}>" if link is not None else "<Session, not connected>"

    # The connection.

    def connect(
        self,
        url: str = DEFAULT_URL,
        _async: bool = False,
        *,
        tls: ssl.SSLContext | None = None,
        timeout: float = CONNECT_S,
    ) -> Any:
        """Connect to the service directory of a robot.

        Args:
            url: "tcp://host:port", "tcps://host:port" for TLS, or a part of it; the port is 9559 if not given.
            tls: For tcps. Without it no certificate is checked, as in the vendor's package: give a context that knows
                the robot's certificate wherever the network is not trusted.
            timeout: For connecting, and again for the login [s].
        Raises:
            RuntimeError: Nobody answers, the login is refused, or this session is connected.
        """
        return _answer(_async, self._connect, url, tls, timeout)

    def _connect(self, url: str, tls: ssl.SSLContext | None, timeout: float) -> None:
        with self._lock:
            if self._connecting or self.isConnected():
                raise RuntimeError("Session is already connected")
            self._connecting = True
        try:
            link = _Link(url, self._open(url, tls, timeout), tls)
            try:
                self._begin(link)
            except Exception:
                link.connection.close(SESSION_CLOSED)
                raise
            with self._lock:
                self._link = link
        finally:
            self._connecting = False
        watcher = self._watcher
        link.connection.on_close(lambda reason: watcher.lost(link))
        self.connected()

    def _open(self, url: str, tls: ssl.SSLContext | None, timeout: float = CONNECT_S) -> Connection:
        """Return a connection that is logged in."""
        connection = connect(url, capabilities=CLIENT_CAPABILITIES, tls=tls, timeout=timeout)
        connection.lookup = self._watcher.lookup
        log_in(connection, None if self._factory is None else self._factory.newAuthenticator(), timeout)
        return connection

    def _begin(self, link: _Link) -> None:
        """Get to know the directory, and follow what it reports."""
        link.directory = RemoteObject(link.connection, 1, 1, _describe(link.connection, 1), lost_text=SESSION_CLOSED)
        directory = proxy_of(link.directory)
        added = directory.serviceAdded.connect(self._watcher.added, _async=True)
        removed = directory.serviceRemoved.connect(self._watcher.removed, _async=True)
        for registered in (added, removed):
            registered.value(ANSWER_S * 1000)
        if link.directory.meta.methods_named("machineId"):
            link.machine_id = str(self._ask(link, "machineId"))

    def _lost(self, link: _Link) -> None:
        with self._lock:
            if self._link is link:
                self._link = None
        for connection in link.connections():
            connection.close(SESSION_CLOSED)
        self.disconnected("disconnected")

    def isConnected(self, _async: bool = False) -> Any:
        """Whether the connection to the directory stands."""
        link = self._link
        connected = link is not None and not link.connection.closed
        return Future(connected) if _async else connected

    def url(self, _async: bool = False) -> Any:
        """Return the address that was dialled. RuntimeError: not connected."""
        return _answer(_async, lambda: self._linked("Session disconnected").url)

    def close(self, _async: bool = False) -> Any:
        """End all connections, and stop listening. Pending calls fail at once."""
        return _answer(_async, self._close)

    def _close(self) -> None:
        with self._lock:
            link = self._link
            servers, self._listeners, self._server = [*self._listeners, self._server], [], None
        if link is not None:
            for connection in link.connections():
                connection.close(SESSION_CLOSED)
        for server in servers:
            if server is not None:
                server.close()

    def setClientAuthenticatorFactory(self, factory: Any) -> None:
        """Log in with `factory.newAuthenticator()`, whose initialAuthData() gives {"user": ..., "token": ...}."""
        self._factory = factory

    def _linked(self, text: str = NOT_CONNECTED) -> _Link:
        link = self._link
        if link is None or link.connection.closed:
            raise RuntimeError(text)
        return link

    def _ask(self, link: _Link, name: str, *args: Any) -> Any:
        """Call the directory."""
        reply = link.directory.call(choose_overload(link.directory.meta, name, args), args)
        return _in_time(reply, f"the service directory does not answer {name}")

    # Services of others.

    def service(self, name: str, timeout: float = INFINITE, _async: bool = False) -> Any:
        """Return a proxy of a service.

        Args:
            timeout: For the whole of it [ms].
        Raises:
            RuntimeError: Not connected, no such service, or it cannot be reached.
        """
        if timeout < INFINITE and not _async:
            return _answer(True, self._service, name).value(timeout)
        return _answer(_async, self._service, name)

    def _service(self, name: str) -> Proxy:
        link = self._linked()
        for number, (own_name, _) in list(link.own.items()):
            if own_name == name:
                connection = self._local(link)
                return proxy_of(RemoteObject(connection, number, 1, _describe(connection, number)))
        remote = link.remotes.get(name)
        if remote is None or not remote.alive:
            info = self._ask(link, "service", name)
            remote = self._reach(link, info)
            with self._lock:
                link.remotes[name] = remote
        return proxy_of(remote)

    def _reach(self, link: _Link, info: Any) -> RemoteObject:
        number, endpoints = info["serviceId"], list(info["endpoints"])
        if link.endpoints is None:
            link.endpoints = list(self._ask(link, "service", "ServiceDirectory")["endpoints"])
        if stays(endpoints, link.url, link.endpoints):
            connection, lost = link.connection, SESSION_CLOSED
        else:
            connection, lost = self._route(link, str(info["machineId"]), endpoints), "Socket Disconnected"
        return RemoteObject(connection, number, 1, _describe(connection, number), lost_text=lost)

    def _route(self, link: _Link, machine: str, endpoints: Sequence[str]) -> Connection:
        """Return the connection to one of these endpoints, a new one if need be."""
        with self._dialling:  # two threads that ask for services of one process share the connection
            for endpoint in endpoints:
                known = link.routes.get((machine, endpoint))
                if known is not None and not known.closed:
                    return known
            here = machine == machine_id() or (machine == link.machine_id and is_loopback(normal(link.url)))
            if split_url(link.url)[0]:  # every connection gets the login data: what began encrypted goes on encrypted
                endpoints = [url for url in dialable(endpoints) if split_url(url)[0]]
                if not endpoints:
                    raise RuntimeError("The service can be reached only by connections that are not encrypted")
            connection = self._dial(candidates(endpoints, here), link.tls)
            with self._lock:
                for endpoint in endpoints:
                    link.routes[machine, endpoint] = connection
                closed = self._link is not link
            if closed:
                connection.close(SESSION_CLOSED)
            return connection

    def _dial(self, urls: Sequence[str], tls: ssl.SSLContext | None) -> Connection:
        """Try all addresses at once; return the first connection that stands."""
        if len(urls) == 1:
            return self._open(urls[0], tls)
        first = Future()
        errors: list[str] = []

        def attempt(url: str) -> None:
            try:
                connection = self._open(url, tls)
            except Exception as error:
                errors.append(str(error))
                if len(errors) == len(urls):
                    first.finish_with_error("; ".join(errors))
                return
            if not first.finish_with_value(connection):
                connection.close(SESSION_CLOSED)

        for url in urls:
            submit(attempt, url)
        return first.value((2 * CONNECT_S + 1.0) * 1000)

    def services(self, _async: bool = False) -> Any:
        """Return the records of all services: name, serviceId, machineId, processId, endpoints ..."""
        return _answer(_async, lambda: list(self._ask(self._linked(), "services")))

    def waitForService(self, name: str, timeout: float = INFINITE, _async: bool = False) -> Any:
        """Wait at most `timeout` ms until a service is registered. RuntimeError: too late, or not connected."""
        try:
            waiting = self._wait_for_service(self._linked(), name)
        except RuntimeError as error:
            if _async:
                return failed(error)
            raise
        return waiting if _async else waiting.value(timeout)

    def _wait_for_service(self, link: _Link, name: str) -> Future:
        there = Future()

        def added(_number: int, added_name: str) -> None:
            if added_name == name:
                there.finish_with_value(None)

        links = [self.serviceRegistered.connect_direct(added)]
        gone = self.disconnected.connect_direct(lambda _reason: there.finish_with_error(SESSION_CLOSED))
        there.when_done(lambda _: (self.serviceRegistered.disconnect(links[0]), self.disconnected.disconnect(gone)))
        if any(info["name"] == name for info in self._ask(link, "services")):
            there.finish_with_value(None)
        return there

    def _service_removed(self, number: int, name: str) -> None:
        link = self._link
        if link is not None:
            remote = link.remotes.pop(name, None)
            if remote is not None and remote.service == number:
                remote.remove("Service removed")
                forget_registrations(remote.connection, remote.service, remote.object)
        self.serviceUnregistered(number, name)

    # Services of one's own.

    def registerService(self, name: str, obj: Any, _async: bool = False) -> Any:
        """Offer a Python object as a service and return its id. Others call it over the connections that stand.

        RuntimeError: not connected, the name is taken, or the object cannot be served.
        """
        return _answer(_async, self._register, name, obj)

    def _register(self, name: str, obj: Any) -> int:
        link, target = self._linked(), served(obj)
        if self._server is not None:
            return self._server.register(name, target)
        values = (name, 0, machine_id(), os.getpid(), self.endpoints(), self._id, target.uid)
        method = choose_overload(link.directory.meta, "registerService", (None,))
        fields = len(parse(method.parameters).children[0].children)
        number = _in_time(link.directory.call(method, (values[:fields],)), "the service directory does not answer")
        with self._lock:
            link.own[number] = (name, target)
        try:
            self._ask(link, "serviceReady", number)
        except RuntimeError:
            link.own.pop(number, None)
            raise
        return number

    def unregisterService(self, id: int, _async: bool = False) -> Any:
        """End a service. RuntimeError: not connected, or no such service."""
        return _answer(_async, self._unregister, id)

    def _unregister(self, number: int) -> None:
        link = self._linked()
        if self._server is not None:
            return self._server.unregister(number)
        self._ask(link, "unregisterService", number)
        link.own.pop(number, None)

    def _lookup(self, service: int, object: int) -> ServedObject | None:
        link = self._link
        own = link.own.get(service) if link is not None and object == 1 else None
        return own[1] if own is not None else None

    def _local(self, link: _Link) -> Connection:
        """Return the connection of this session to its own services."""
        with self._lock:
            if link.local is None or link.local[0].closed:
                ends = []
                for dialled, stream in zip((True, False), socket.socketpair()):
                    stream.setblocking(False)
                    end = Connection(stream, capabilities=CLIENT_CAPABILITIES, dialled=dialled, peer="this session")
                    end.learn(dict(CLIENT_CAPABILITIES))
                    end.lookup = self._watcher.lookup
                    end.trust()
                    end.start()
                    ends.append(end)
                link.local = (ends[0], ends[1])
            return link.local[0]

    def listen(self, url: str = "tcp://0.0.0.0:0", _async: bool = False) -> Any:
        """Accept connections to this session's services at an address, too. RuntimeError: it cannot be used."""
        return _answer(_async, self._listen, url)

    def _listen(self, url: str) -> None:
        server = Server(url, dialect=PYTHON, lookup=self._watcher.lookup, machine_id=machine_id())
        _start(server)
        with self._lock:
            self._listeners.append(server)

    def listenStandalone(self, url: str | Sequence[str] = DEFAULT_URL, _async: bool = False) -> Any:
        """Be a robot of one's own: a service directory at an address, with this session's services.

        RuntimeError: the address cannot be used, or this session is connected.
        """
        return _answer(_async, self._listen_standalone, url)

    def _listen_standalone(self, url: str | Sequence[str]) -> None:
        urls = [url] if isinstance(url, str) else list(url)
        if len(urls) != 1:
            raise RuntimeError("listenStandalone takes one address; listen at 0.0.0.0 to be reached by all of them")
        if self.isConnected():
            raise RuntimeError("Session is already connected")
        server = Server(urls[0], dialect=PYTHON, machine_id=machine_id())
        _start(server)
        with self._lock:
            self._server = server
        try:
            self._connect(server.endpoints[0], None, CONNECT_S)
        except RuntimeError:
            self._close()
            raise

    def endpoints(self, _async: bool = False) -> Any:
        """Return the addresses at which this session listens."""
        servers = [*([self._server] if self._server is not None else []), *self._listeners]
        return _answer(_async, lambda: [endpoint for server in servers for endpoint in server.endpoints])

    def loadServiceRename(self, *_: Any) -> None:
        """Not offered: modules of the vendor's framework cannot be loaded by plain Python."""
        raise RuntimeError("loadServiceRename: modules cannot be loaded by telepresence.naoqi")

    callModule = loadServiceRename

    def _forked(self) -> None:
        """A forked child has no connection, whatever its parent has."""
        self._lock, self._dialling = threading.RLock(), threading.Lock()
        self._link, self._connecting, self._server, self._listeners = None, False, None, []


def machine_id() -> str:
    """Return what tells this machine from others; stays the same from start to start."""
    return str(uuid.UUID(int=uuid.getnode()))


def _start(server: Server) -> None:
    try:
        server.start()
    except OSError as error:
        raise RuntimeError(f"Cannot listen: {error}") from None


def _in_time(reply: Future, text: str) -> Any:
    reply.wait(ANSWER_S * 1000)
    if reply.isRunning():
        raise RuntimeError(f"{text} within {ANSWER_S:g} s")
    return reply.value()


def _describe(connection: Connection, service: int) -> MetaObject:
    """Return the metaobject of a service's main object."""
    asked = RemoteObject(connection, service, 1, MetaObject(), lost_text=SESSION_CLOSED)
    reply = asked.start(_META_OBJECT, [bytes(4)], METAOBJECT)
    return MetaObject.from_value(_in_time(reply, f"service {service} does not describe itself"))


def _answer(_async: bool, function: Callable[..., Any], *args: Any) -> Any:
    """Call a function, or have it called on a worker and return the future of its result."""
    if not _async:
        return function(*args)
    result = Future()

    def run() -> None:
        try:
            result.finish_with_value(function(*args))
        except Exception as error:
            result.finish_with_error(error if isinstance(error, RuntimeError) else describe(error))

    submit(run)
    return result


def _after_fork() -> None:
    for session in list(_sessions):
        session._forked()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
