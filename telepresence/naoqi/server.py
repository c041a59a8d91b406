"""A NAOqi server: the service directory and the services of one process behind one port."""

from __future__ import annotations

import errno
import logging
import socket
import ssl
import struct
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

from .connection import Connection
from .dial import split_url
from .directory import MAIN_OBJECT, SERVICE_ID, Directory, this_machine
from .dynamics import ROBOT, Dialect, Record
from .future import Future, failed
from .limits import Limits
from .login import ServerLogin
from .proxy import Proxy
from .reactor import READ, Timer, reactor
from .releases import RELEASES, Release
from .served_object import ServedObject
from .signals import Signal
from .socket_options import prepare

log = logging.getLogger(__name__)

_BACKLOG = 4096
_ACCEPTED_AT_ONCE = 64
_PAUSE_S = 0.1
"""Pause before the next connection is accepted when descriptors or memory have run out [s]."""
_WARN_S = 10.0
"""Between two warnings of the same kind [s]."""
_EVICTED_AT_ONCE = 16
_CHECK_S = 1.0
_EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_ASK_S = 10.0
_SIOCGIFADDR = 0x8915


class Server:
    """Serves objects on a TCP port as a robot does.

    Args:
        url: Where to listen, "tcp://host:port" or "tcps://host:port"; port 0 takes a free one.
        release: Which robot to play.
        login: Password by user; None: whoever reaches the port is in, as on NAOqi up to 2.8.
        tls: Certificate and key, needed for tcps.
        dialect: How numbers are sent inside dynamics.
        machine_id: What machineId() answers; clients on the same machine compare it.
        lookup: (service, object) -> object or None, asked before the directory: what a session offers under numbers
            that another directory has given.
        only_from: Addresses whose connections are taken, and which reach nothing but what `lookup` returns, not even
            the directory; the others are refused. None: everybody reaches everything.
    """

    def __init__(
        self,
        url: str = "tcp://127.0.0.1:0",
        *,
        release: Release = RELEASES["libqi 4"],
        login: Mapping[str, str] | None = None,
        tls: ssl.SSLContext | None = None,
        limits: Limits = Limits(),  # noqa: B008 -- frozen
        dialect: Dialect = ROBOT,
        machine_id: str = "",
        lookup: Callable[[int, int], ServedObject | None] | None = None,
        only_from: Collection[str] | None = None,
    ) -> None:
        self._url, self._release, self._login, self._tls = url, release, login, tls
        self._limits, self._dialect = limits, dialect
        self._other_objects = lookup
        self._only_from = None if only_from is None else frozenset(only_from)
        self._reactor = reactor()
        self._listener: socket.socket | None = None
        self._connections: set[Connection] = set()
        self._arriving: dict[Connection, None] = {}
        self._address: tuple[str, int] | None = None
        self._timer: Timer | None = None
        self._closed = False
        self._warned = -_WARN_S
        self._directory = Directory(release.service_info_signature, machine_id or this_machine(), self._listed)
        self.serviceRegistered: Signal = self._directory.added
        self.serviceUnregistered: Signal = self._directory.removed

    # --- services

    def register(self, name: str, served: ServedObject) -> int:
        """Add a service, also before `start`, and return its id.

        Raises: RuntimeError: The name is taken.
        """
        return self._directory.register(name, served)

    def unregister(self, number: int) -> None:
        """Remove a service.

        Raises: RuntimeError: There is none with that id.
        """
        self._directory.unregister(number)

    def services(self) -> list[Record]:
        """Return what the directory lists, itself first."""
        return [Record(info) for info in self._directory.infos()]

    # --- life

    @property
    def endpoints(self) -> list[str]:
        """The URLs that clients can connect to."""
        return self._listed(None)

    def start(self) -> None:
        """Listen. All services registered before are there when the port answers.

        Raises: OSError: The address cannot be used; the text says which and why.
        """
        try:
            secure, host, port = split_url(self._url)
        except RuntimeError as error:
            raise OSError(str(error)) from None
        if secure != (self._tls is not None):
            raise OSError(f"cannot listen on {self._url}: {'it needs a certificate' if secure else 'TLS is for tcps'}")
        try:
            listener = _listen(host, port)
        except OSError as error:
            hint = "; another robot may run there (port 0 takes a free one)" if error.errno == errno.EADDRINUSE else ""
            raise OSError(error.errno, f"cannot listen on {self._url}: {error.strerror or error}{hint}") from None
        self._listener = listener
        self._address = listener.getsockname()[:2]
        self._reactor.run(self._begin)

    def close(self) -> None:
        """End every connection. Calling it again does nothing."""
        if self._listener is None or self._closed:
            return
        self._reactor.run(self._end)
        self._reactor.run(_turn)  # the connections close their sockets in the reactor's next turn

    def __enter__(self) -> Server:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def remote(self, name: str) -> Any:
        """Return a Proxy of a service that a client has registered; its calls go over the client's connection.

        Raises: RuntimeError: There is none, or the client does not answer.
        """
        reached = self.reach(name)
        reached.wait(_ASK_S * 1000)
        if reached.isRunning():
            raise RuntimeError(f"service '{name}' does not describe itself within {_ASK_S:g} s")
        return Proxy(reached.value())

    def reach(self, name: str) -> Future:
        """Return the future of the RemoteObject that such a proxy stands for. It has no time limit.

        It fails with a RuntimeError if there is no such service, or the client gives no answer of use.
        """
        entry = self._directory.find(name)
        if entry is None or entry.owner is None:
            return failed(f"Cannot find service '{name}' in index")
        return entry.reach()

    # --- on the reactor's thread

    def _begin(self) -> None:
        assert self._listener is not None
        self._reactor.watch(self._listener, READ, self._accept)
        self._timer = self._reactor.call_later(_CHECK_S, self._check)

    def _end(self) -> None:
        assert self._listener is not None
        self._closed = True
        if self._timer is not None:
            self._timer.cancel()
        self._reactor.change(self._listener, 0, self._accept)
        self._listener.close()
        for connection in list(self._connections):
            connection.close("Session closed")

    def _check(self) -> None:
        now = time.monotonic()
        for connection in list(self._connections):
            connection.check(now)
        self._timer = self._reactor.call_later(_CHECK_S, self._check)

    def _accept(self, _mask: int) -> None:
        assert self._listener is not None
        for _ in range(_ACCEPTED_AT_ONCE):
            try:
                stream, address = self._listener.accept()
            except (BlockingIOError, InterruptedError):
                return
            except OSError as error:
                if error.errno == errno.ECONNABORTED:
                    continue
                return self._pause(error)
            if self._only_from is not None and address[0] not in self._only_from:
                self._warn("%s is refused: only %s may connect", address[0], ", ".join(sorted(self._only_from)))
                stream.close()
            elif _still_there(stream):
                self._welcome(stream, address)
            else:
                stream.close()

    def _pause(self, error: OSError) -> None:
        """Accept nothing for a moment: the descriptors are used up, or the network is away."""
        assert self._listener is not None
        self._warn("no connection can be accepted: %s", error.strerror or error)
        if error.errno in _EXHAUSTED and self._arriving:
            for _ in range(min(len(self._arriving), _EVICTED_AT_ONCE)):
                self._evict("it had not logged in when the descriptors were used up")
        self._reactor.change(self._listener, 0, self._accept)
        self._reactor.call_later(_PAUSE_S, self._go_on)

    def _warn(self, text: str, *values: Any) -> None:
        """Log a warning, but not for every connection of a flood."""
        if time.monotonic() - self._warned > _WARN_S:
            self._warned = time.monotonic()
            log.warning(text, *values)

    def _go_on(self) -> None:
        if not self._closed and self._listener is not None:
            self._reactor.change(self._listener, READ, self._accept)

    def _evict(self, reason: str) -> None:
        """Close the connection that has been waiting longest without a login."""
        oldest = next(iter(self._arriving))
        self._gone(oldest)
        oldest.close(reason)

    def _welcome(self, stream: socket.socket, address: Any) -> None:
        """Make a connection of an accepted socket, or close it."""
        if len(self._connections) >= self._limits.connections:
            if not self._arriving:
                self._warn("%s is refused: there are %d connections", address[0], len(self._connections))
                stream.close()
                return
            self._evict(f"there are {self._limits.connections} connections, and it is not logged in")
        try:
            prepare(stream)
            if self._tls is not None:
                stream = self._tls.wrap_socket(stream, server_side=True, do_handshake_on_connect=False)
        except (OSError, ValueError) as error:  # reset before it was accepted
            log.debug("%s: %s", address[0], error)
            stream.close()
            return
        connection = Connection(
            stream,
            capabilities=self._release.capabilities,
            limits=self._limits,
            dialect=self._dialect,
            peer=f"{address[0]}:{address[1]}",
        )
        connection.lookup = self._lookup
        login = ServerLogin(connection, self._release, self._login, lambda: self._arriving.pop(connection, None))
        connection.before_login = login.handle
        self._connections.add(connection)
        self._arriving[connection] = None
        connection.on_close(lambda reason: self._reactor.call_soon(self._gone, connection))
        connection.start()

    def _gone(self, connection: Connection) -> None:
        self._connections.discard(connection)
        self._arriving.pop(connection, None)
        self._directory.connection_ended(connection)

    def _lookup(self, service: int, number: int) -> ServedObject | None:
        found = self._other_objects(service, number) if self._other_objects is not None else None
        if found is not None or self._only_from is not None:
            return found
        if number != MAIN_OBJECT:
            return None
        if service == SERVICE_ID:
            return self._directory
        entry = self._directory.at(service)
        return (entry.served or entry.relay) if entry is not None else None

    def _listed(self, connection: Connection | None) -> list[str]:
        """Return where the server listens, as the peer of `connection` should hear of it."""
        if self._address is None:
            return []
        host, port = self._address
        scheme = "tcps" if self._tls is not None else "tcp"
        hosts = [host]
        if host in ("0.0.0.0", "::"):
            hosts = interface_addresses()
            if connection is not None and connection.here not in (*hosts, ""):
                hosts.append(connection.here)
        names = [f"[{one}]" if ":" in one else one for one in sorted(set(hosts))]
        return [f"{scheme}://{name}:{port}" for name in names]


def interface_addresses() -> list[str]:
    """Return this machine's IPv4 addresses, that of the loopback interface included."""
    found = {"127.0.0.1"}
    try:
        import fcntl
    except ImportError:  # not Linux
        found.update(info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET))  # type: ignore[misc]
        return sorted(found)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        for _, name in socket.if_nameindex():
            request = struct.pack("256s", name.encode()[:15])
            try:
                answer = fcntl.ioctl(asking.fileno(), _SIOCGIFADDR, request)
            except OSError:
                continue  # an interface without an address
            found.add(socket.inet_ntoa(answer[20:24]))
    return sorted(found)


def _still_there(stream: socket.socket) -> bool:
    """Whether an accepted socket was not reset in the meantime: asking is cheaper than making a connection of it."""
    try:
        stream.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
    except (BlockingIOError, InterruptedError):
        return True
    except OSError:
        return False
    return True


def _listen(host: str, port: int) -> socket.socket:
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(_BACKLOG)
        listener.setblocking(False)
    except OSError:
        listener.close()
        raise
    return listener


def _turn() -> None:
    """Wait for a turn of the reactor."""
