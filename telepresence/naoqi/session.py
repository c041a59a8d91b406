"""A session: a connection to a robot's service directory and what is reached by it. The interface is the vendor's.

Every step that waits for the other side has a time limit, except calls of services, as in the vendor's package: a
method may take as long as it wants, and a lost connection ends them.
"""

from __future__ import annotations

import os
import ssl
import sys
import threading
import uuid
import weakref
from collections.abc import Callable, Collection, Sequence
from typing import Any

from .connection import Connection
from .dial import CONNECT_S, connect
from .directory_link import SESSION_CLOSED, DirectoryLink, describe_object, machine_id
from .dynamics import PYTHON
from .future import INFINITE, Future, describe, failed
from .limits import Limits
from .login import log_in
from .proxy import Proxy
from .python_object import served
from .reactor import reactor
from .releases import CLIENT_CAPABILITIES
from .remote_object import RemoteObject, forget_registrations
from .served_object import ServedObject
from .server import Server
from .signals import Signal
from .workers import submit

DEFAULT_URL = "tcp://127.0.0.1:9559"
NOT_CONNECTED = "Session not connected."

_sessions: weakref.WeakSet[Session] = weakref.WeakSet()


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

    def lost(self, link: DirectoryLink) -> None:
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
        self._link: DirectoryLink | None = None
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
            connection = self._open(url, tls, timeout)
            try:
                link = DirectoryLink(url, connection, self._opener(tls))
                link.follow(self._watcher.added, self._watcher.removed)
            except Exception:
                connection.close(SESSION_CLOSED)
                raise
            with self._lock:
                self._link = link
        finally:
            self._connecting = False
        watcher = self._watcher
        link.connection.on_close(lambda reason: watcher.lost(link))
        self.connected()

    def _open(self, url: str, tls: ssl.SSLContext | None, timeout: float) -> Connection:
        return self._opener(tls, timeout)(url)

    def _opener(self, tls: ssl.SSLContext | None, timeout: float = CONNECT_S) -> Callable[[str], Connection]:
        """Return what opens a connection and logs in there. It does not hold this session."""
        factory, lookup = self._factory, self._watcher.lookup

        def open_(url: str) -> Connection:
            connection = connect(url, capabilities=CLIENT_CAPABILITIES, tls=tls, timeout=timeout)
            connection.lookup = lookup
            log_in(connection, None if factory is None else factory.newAuthenticator(), timeout)
            return connection

        return open_

    def _lost(self, link: DirectoryLink) -> None:
        with self._lock:
            if self._link is link:
                self._link = None
        link.close(abort=True)  # what has not reached the robot's other programs by now is not sent any more
        self.disconnected("disconnected")

    def isConnected(self, _async: bool = False) -> Any:
        """Whether the connection to the directory stands."""
        link = self._link
        connected = link is not None and not link.connection.closed
        return Future(connected) if _async else connected

    def url(self, _async: bool = False) -> Any:
        """Return the address that was dialled. RuntimeError: not connected."""
        return _answer(_async, lambda: self._linked("Session disconnected").url)

    def ends(self) -> tuple[str, str]:
        """Return the addresses of this and of the other end of the connection. RuntimeError: not connected."""
        connection = self._linked().connection
        return connection.here, connection.there

    def close(self, _async: bool = False, *, abort: bool = False) -> Any:
        """End all connections, and stop listening. Pending calls fail at once.

        Args:
            abort: The robot counts as lost. What was sent and has not reached it is thrown away; without this the
                kernel goes on trying for a few seconds, and a robot that is back carries it out.
        """
        return _answer(_async, self._close, abort)

    def _close(self, abort: bool = False) -> None:
        with self._lock:
            link = self._link
            servers, self._listeners, self._server = [*self._listeners, self._server], [], None
        if link is not None:
            link.close(abort)
        for server in servers:
            if server is not None:
                server.close()

    def setClientAuthenticatorFactory(self, factory: Any) -> None:
        """Log in with `factory.newAuthenticator()`, whose initialAuthData() gives {"user": ..., "token": ...}."""
        self._factory = factory

    def _linked(self, text: str = NOT_CONNECTED) -> DirectoryLink:
        link = self._link
        if link is None or link.connection.closed:
            raise RuntimeError(text)
        return link

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
        own = [number for number, (own_name, _) in list(link.own.items()) if own_name == name]
        if not own:
            return link.find(name)
        remote = link.remotes.get(name)
        if remote is None or not remote.alive or remote.service != own[0]:
            connection = link.to_own(self._watcher.lookup)
            remote = link.remotes[name] = RemoteObject(connection, own[0], 1, describe_object(connection, own[0]))
        return Proxy(remote)

    def services(self, _async: bool = False) -> Any:
        """Return the records of all services: name, serviceId, machineId, processId, endpoints ..."""
        return _answer(_async, lambda: self._linked().services())

    def waitForService(self, name: str, timeout: float = INFINITE, _async: bool = False) -> Any:
        """Wait at most `timeout` ms until a service is registered. RuntimeError: too late, or not connected."""
        try:
            waiting = self._wait_for_service(self._linked(), name)
        except RuntimeError as error:
            if _async:
                return failed(error)
            raise
        return waiting if _async else waiting.value(timeout)

    def _wait_for_service(self, link: DirectoryLink, name: str) -> Future:
        there = Future()

        def added(_number: int, added_name: str) -> None:
            if added_name == name:
                there.finish_with_value(None)

        links = [self.serviceRegistered.connect_direct(added)]
        gone = self.disconnected.connect_direct(lambda _reason: there.finish_with_error(SESSION_CLOSED))
        there.when_done(lambda _: (self.serviceRegistered.disconnect(links[0]), self.disconnected.disconnect(gone)))
        if any(info["name"] == name for info in link.services()):
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
        return link.register(values, target)

    def unregisterService(self, id: int, _async: bool = False) -> Any:
        """End a service. RuntimeError: not connected, or no such service."""
        return _answer(_async, self._unregister, id)

    def _unregister(self, number: int) -> None:
        link = self._linked()
        if self._server is not None:
            return self._server.unregister(number)
        link.unregister(number)

    def _lookup(self, service: int, object: int) -> ServedObject | None:
        link = self._link
        own = link.own.get(service) if link is not None and object == 1 else None
        return own[1] if own is not None else None

    def listen(
        self,
        url: str = "tcp://0.0.0.0:0",
        _async: bool = False,
        *,
        only_from: Collection[str] | None = None,
        limits: Limits = Limits(),  # noqa: B008 -- frozen
    ) -> Any:
        """Accept connections to this session's services at an address, too. RuntimeError: it cannot be used.

        Args:
            only_from: Addresses from which connections are taken; they reach these services alone. None: as the
                vendor's package, everybody, who finds a service directory there.
            limits: What each of them may hold.
        """
        return _answer(_async, self._listen, url, only_from, limits)

    def _listen(self, url: str, only_from: Collection[str] | None, limits: Limits) -> None:
        own, machine = self._watcher.lookup, machine_id()
        server = Server(url, dialect=PYTHON, lookup=own, machine_id=machine, only_from=only_from, limits=limits)
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
        self._lock = threading.RLock()
        self._link, self._connecting, self._server, self._listeners = None, False, None, []


def _start(server: Server) -> None:
    try:
        server.start()
    except OSError as error:
        raise RuntimeError(f"Cannot listen: {error}") from None


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
