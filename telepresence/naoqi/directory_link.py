"""One connection to a service directory, and everything that is reached by it and ends with it.

Every answer of the directory has a time limit (`ANSWER_S`), and its records are checked: a robot may say anything.
"""

from __future__ import annotations

import socket
import threading
import uuid
from collections.abc import Callable, Sequence
from typing import Any

from .connection import Connection
from .dial import CONNECT_S, split_url
from .dynamics import Record
from .future import Future
from .metaobject import METAOBJECT, MetaObject, choose_overload
from .proxy import Proxy
from .releases import CLIENT_CAPABILITIES
from .remote_object import DISCONNECTED, RemoteObject
from .routing import candidates, dialable, is_loopback, normal, stays
from .served_object import ServedObject
from .signature import WireError, parse
from .workers import submit

ANSWER_S = 10.0
"""Seconds within which the service directory must answer, and a service must describe itself."""
SESSION_CLOSED = "Session closed"
_META_OBJECT = 2
_INFO_FIELDS = ("name", "serviceId", "machineId", "processId", "endpoints", "sessionId", "objectUid")
_INFO_TYPES = {"name": str, "serviceId": int, "machineId": str, "endpoints": list}


class DirectoryLink:
    """A connection to a directory.

    Args:
        url: Address that was dialled.
        connection: Logged in.
        open_: Returns another connection, logged in like this one, to an address.
    Attributes:
        remotes: Services that have been asked for, by name.
        own: What this end has registered there, by id: name and object.
        local: Both ends of this session's connection to its own services.
    Raises:
        RuntimeError: What answers there is no service directory.
    """

    def __init__(self, url: str, connection: Connection, open_: Callable[[str], Connection]) -> None:
        self.url = url
        self.connection = connection
        self.remotes: dict[str, RemoteObject] = {}
        self.own: dict[int, tuple[str, ServedObject]] = {}
        self.local: tuple[Connection, Connection] | None = None
        self._open = open_
        self._endpoints: list[str] | None = None
        self._routes: dict[tuple[str, str], Connection] = {}
        self._lock = threading.Lock()
        meta = describe_object(connection, 1)
        if meta.signal("serviceAdded") is None or meta.signal("serviceRemoved") is None:
            raise RuntimeError("Service 1 is no service directory")
        self._directory = RemoteObject(connection, 1, 1, meta, lost_text=SESSION_CLOSED)
        self._machine_id = str(self._ask("machineId")) if meta.methods_named("machineId") else ""

    def follow(self, added: Callable[[int, str], Any], removed: Callable[[int, str], Any]) -> None:
        """Call `added(id, name)` and `removed(id, name)` when services come and go."""
        directory = Proxy(self._directory)
        asked = [
            directory.serviceAdded.connect(added, _async=True),
            directory.serviceRemoved.connect(removed, _async=True),
        ]
        for reply in asked:
            in_time(reply, "the service directory does not report what changes")

    def connections(self) -> list[Connection]:
        """Return all connections, the directory's last."""
        others = {id(one): one for one in [*self._routes.values(), *(self.local or ())] if one is not self.connection}
        return [*others.values(), self.connection]

    def close(self, abort: bool = False) -> None:
        """End all connections; pending calls fail. `abort`: the robot counts as lost, see `Connection.close`."""
        for connection in self.connections():
            connection.close(SESSION_CLOSED, abort)

    def services(self) -> list[Record]:
        """Return the records of all services."""
        listed = self._ask("services")
        if not isinstance(listed, (list, tuple)):
            raise WireError(f"the list of services is a list, not {type(listed).__name__}")
        return [_info(value) for value in listed]

    def register(self, values: Sequence[Any], target: ServedObject) -> int:
        """Register a service and return its id.

        Args:
            values: The fields of its record; older directories have no objectUid.
        """
        method = choose_overload(self._directory.meta, "registerService", (None,))
        fields = max([len(kind.children) for kind in parse(method.parameters).children], default=0)
        number = in_time(
            self._directory.call(method, (values[:fields],)), "the service directory does not answer registerService"
        )
        if not isinstance(number, int):
            raise WireError(f"the id of a service is a number, not {type(number).__name__}")
        self.own[number] = (values[0], target)  # others may call it as soon as it is ready
        try:
            self._ask("serviceReady", number)
        except RuntimeError:
            self.own.pop(number, None)
            raise
        return number

    def unregister(self, number: int) -> None:
        """End a service."""
        self._ask("unregisterService", number)
        name, _ = self.own.pop(number, ("", None))
        if name:
            self.remotes.pop(name, None)
            for connection in self.connections():
                connection.references.drop_service(number)

    def to_own(self, lookup: Callable[[int, int], ServedObject | None]) -> Connection:
        """Return the connection of this session to its own services, which `lookup` knows."""
        with self._lock:
            if self.local is None or self.local[0].closed:
                ends = []
                for dialled, stream in zip((True, False), socket.socketpair()):
                    stream.setblocking(False)
                    end = Connection(stream, capabilities=CLIENT_CAPABILITIES, dialled=dialled, peer="this session")
                    end.learn(dict(CLIENT_CAPABILITIES))
                    end.lookup = lookup
                    end.trust()
                    end.start()
                    ends.append(end)
                self.local = (ends[0], ends[1])
            return self.local[0]

    def find(self, name: str) -> Proxy:
        """Return a proxy of a service, after connecting to where it is."""
        remote = self.remotes.get(name)
        if remote is None or not remote.alive:
            remote = self.remotes[name] = self._reach(_info(self._ask("service", name)))
        return Proxy(remote)

    def _ask(self, name: str, *args: Any) -> Any:
        """Call the directory."""
        reply = self._directory.call(choose_overload(self._directory.meta, name, args), args)
        return in_time(reply, f"the service directory does not answer {name}")

    def _reach(self, info: Record) -> RemoteObject:
        number, endpoints = info["serviceId"], info["endpoints"]
        if self._endpoints is None:
            self._endpoints = _info(self._ask("service", "ServiceDirectory"))["endpoints"]
        if stays(endpoints, self.url, self._endpoints):
            connection, lost = self.connection, SESSION_CLOSED
        else:
            connection, lost = self._route(info["machineId"], endpoints), DISCONNECTED
        return RemoteObject(connection, number, 1, describe_object(connection, number), lost_text=lost)

    def _route(self, machine: str, endpoints: Sequence[str]) -> Connection:
        """Return the connection to one of these endpoints, a new one if need be."""
        with self._lock:  # two threads that ask for services of one process share the connection
            for endpoint in endpoints:
                known = self._routes.get((machine, endpoint))
                if known is not None and not known.closed:
                    return known
            here = machine == machine_id() or (machine == self._machine_id and is_loopback(normal(self.url)))
            if split_url(self.url)[0]:  # every connection gets the login data: what began encrypted goes on encrypted
                endpoints = [url for url in dialable(endpoints) if split_url(url)[0]]
                if not endpoints:
                    raise RuntimeError("The service can be reached only by connections that are not encrypted")
            connection = self._dial(candidates(endpoints, here))
            self._routes = {place: known for place, known in self._routes.items() if not known.closed}
            for endpoint in endpoints:
                self._routes[machine, endpoint] = connection
            if self.connection.closed:  # meanwhile, so that nobody else closes this one
                connection.close(SESSION_CLOSED)
            return connection

    def _dial(self, urls: Sequence[str]) -> Connection:
        """Try all addresses at once; return the first connection that stands."""
        if len(urls) == 1:
            return self._open(urls[0])
        first = Future()
        errors: list[str] = []

        def attempt(url: str) -> None:
            try:
                connection = self._open(url)
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


def machine_id() -> str:
    """Return what tells this machine from others; stays the same from start to start."""
    return str(uuid.UUID(int=uuid.getnode()))


def describe_object(connection: Connection, service: int) -> MetaObject:
    """Return the metaobject of a service's main object. RuntimeError: it does not answer, or with something else."""
    asked = RemoteObject(connection, service, 1, MetaObject(), lost_text=SESSION_CLOSED)
    reply = asked.start(_META_OBJECT, [bytes(4)], METAOBJECT)
    return MetaObject.from_value(in_time(reply, f"service {service} does not describe itself"))


def in_time(reply: Future, text: str) -> Any:
    """Return the value of a reply. RuntimeError: `text`, if it does not come in time."""
    reply.wait(ANSWER_S * 1000)
    if reply.isRunning():
        raise RuntimeError(f"{text} within {ANSWER_S:g} s")
    return reply.value()


def _info(value: Any) -> Record:
    """Return a ServiceInfo by its fields, whatever form it has. WireError: it has none."""
    info = Record(zip(_INFO_FIELDS, value)) if isinstance(value, (list, tuple)) else value
    typed = isinstance(info, Record) and all(isinstance(info.get(name), kind) for name, kind in _INFO_TYPES.items())
    if not typed or not all(isinstance(endpoint, str) for endpoint in info["endpoints"]):
        raise WireError("a record of the service directory is malformed")
    return info
